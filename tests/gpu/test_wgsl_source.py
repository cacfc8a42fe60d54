"""Includes and directives of WGSL files, and errors that name file and line."""

from __future__ import annotations

from pathlib import Path

import pytest

from dermis.base.errors import DermisError
from dermis.gpu import ComputeProgram, Device
from dermis.gpu.wgsl_source import ShaderFolder, ShaderListMember, compose_shader


def write(folder: Path, **files: str) -> Path:
    for stem, text in files.items():
        (folder / f"{stem}.wgsl").write_text(text)
    return folder


def test_each_line_has_its_source_file(tmp_path: Path) -> None:
    write(tmp_path, main='// a\n//#include "part.wgsl"\n// b', part="// one\n// two")
    source = compose_shader(tmp_path / "main.wgsl", ())
    assert source.text.splitlines() == ["// a", "// one", "// two", "// b"]
    assert source.origin == (("main.wgsl", 1), ("part.wgsl", 1), ("part.wgsl", 2), ("main.wgsl", 3))


def test_cyclic_include_is_inserted_once(tmp_path: Path) -> None:
    circle = '//#include "a.wgsl"\n//#include "b.wgsl"\n// '
    write(tmp_path, a=f"{circle}a", b=f"{circle}b", main=f"{circle}main")
    assert compose_shader(tmp_path / "main.wgsl", ()).text.splitlines() == ["// b", "// a", "// main"]


def test_neighbouring_file_precedes_include_folders(tmp_path: Path) -> None:
    for name in ("near", "far"):
        (tmp_path / name).mkdir()
        write(tmp_path / name, part=f"// {name}")
    write(tmp_path / "far", other="// other")
    near = write(tmp_path / "near", main='//#include "part.wgsl"\n//#include "other.wgsl"') / "main.wgsl"
    assert compose_shader(near, (tmp_path / "far",)).text.splitlines() == ["// near", "// other"]


def test_missing_include_is_named(tmp_path: Path) -> None:
    write(tmp_path, main='//#include "gone.wgsl"')
    with pytest.raises(DermisError, match=r'main\.wgsl.*"gone\.wgsl"'):
        compose_shader(tmp_path / "main.wgsl", ())


@pytest.mark.parametrize(
    ("options", "lines"), [((), "cd"), (("A",), "a"), (("A", "B"), "ab"), (("B",), "cd")]
)
def test_lines_of_options_are_selected(tmp_path: Path, options: tuple[str, ...], lines: str) -> None:
    text = '//#if A\na\n//#if B\nb\n//#end\n//#else\nc\n//#include "part.wgsl"\n//#end'
    write(tmp_path, main=text, part="d")
    folder = ShaderFolder(tmp_path, options=frozenset(options))
    source = compose_shader(tmp_path / "main.wgsl", (folder,))
    assert source.text.splitlines() == list(lines)
    numbers = {"a": 2, "b": 4, "c": 7, "d": 1}
    assert [number for _, number in source.origin] == [numbers[line] for line in lines]


@pytest.mark.parametrize("text", ["//#if A\na", "a\n//#else\nb", "//#end"])
def test_options_without_begin_or_end_are_named(tmp_path: Path, text: str) -> None:
    write(tmp_path, main=text)
    with pytest.raises(DermisError, match=r"main\.wgsl: expected //#(end|if)"):
        compose_shader(tmp_path / "main.wgsl", ())


def test_only_whole_lines_include(tmp_path: Path) -> None:
    text = '// as in: //#include "gone.wgsl"'
    write(tmp_path, main=text)
    assert compose_shader(tmp_path / "main.wgsl", ()).text == text


def test_growing_list_of_includes_is_repeated(tmp_path: Path) -> None:
    write(
        tmp_path,
        main="//#include <pets>\n    //#each pets: {name} {NAME} {number} {legs}",
        cat="// cat",
        emu="// emu",
    )
    pets = [ShaderListMember("tom-cat", tmp_path / "cat.wgsl", (("legs", "4"),))]
    folder = ShaderFolder(tmp_path, {"pets": lambda: pets})
    assert compose_shader(tmp_path / "main.wgsl", (folder,)).text.splitlines() == [
        "// cat",
        "    tom_cat TOM_CAT 0u 4",
    ]
    pets.append(ShaderListMember("emu", tmp_path / "emu.wgsl", (("legs", "2"),)))
    source = compose_shader(tmp_path / "main.wgsl", (folder,))
    assert source.text.splitlines()[1:] == ["// emu", "    tom_cat TOM_CAT 0u 4", "    emu EMU 1u 2"]
    assert source.origin[-2:] == (("main.wgsl", 2), ("main.wgsl", 2))


def test_python_constants_are_substituted(tmp_path: Path) -> None:
    write(tmp_path, main="//#fill const A: f32 = {a}; // {b} of them")
    folder = ShaderFolder(tmp_path, numbers=lambda: {"a": 0.25, "b": 3})
    assert compose_shader(tmp_path / "main.wgsl", (folder,)).text == "const A: f32 = 0.25; // 3 of them"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("//#include <gone>", "the list <gone>"),
        ("//#each gone: {name}", "the list <gone>"),
        ("//#fill {gone}", "a word of a, but got {gone}"),
        ("//#each pets: {gone}", "a word of name, NAME, number, but got {gone}"),
    ],
)
def test_missing_constant_is_named(tmp_path: Path, text: str, error: str) -> None:
    write(tmp_path, main=text)
    pets = [ShaderListMember("cat", tmp_path / "cat.wgsl")]
    folder = ShaderFolder(tmp_path, {"pets": lambda: pets}, lambda: {"a": 1})
    with pytest.raises(DermisError, match=f"main.wgsl: expected .*{error}"):
        compose_shader(tmp_path / "main.wgsl", (folder,))


@pytest.mark.parametrize("broken", ["let a: u32 = 1.5;", "let a = unknown;", "let = ;"])
def test_compile_error_names_file_and_line_of_an_include(device: Device, tmp_path: Path, broken: str) -> None:
    write(
        tmp_path,
        main='// one\n// two\n//#include "part.wgsl"\n@compute @workgroup_size(1) fn main() { f(); }',
        part=f"// fine\nfn f() {{\n    {broken}\n}}",
    )
    with pytest.raises(DermisError, match=r"main\.wgsl: the shader did not compile(?s:.*)part\.wgsl:3:"):
        ComputeProgram(device, tmp_path / "main.wgsl")


def test_lines_of_other_files_are_unchanged(tmp_path: Path) -> None:
    write(tmp_path, main="// only")
    source = compose_shader(tmp_path / "main.wgsl", ())
    assert source.locate("wgsl:1:4 and wgsl:99:1") == "main.wgsl:1:4 and wgsl:99:1"
