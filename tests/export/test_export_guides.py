"""READMEs of exports: files, import, picture and licence."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from small_head import write_head

from dermis.apps.export.guide import file_meaning, guide_lines, write_preview
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.export.target import Target
from dermis.images.codecs import png_size


def table_rows(page: str) -> dict[str, str]:
    """Return the contents of files by their names, from the table of a README."""
    rows = (line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| `"))
    return {name.split("`")[1]: meaning for name, meaning in rows}


@pytest.mark.parametrize("name", list(TARGETS))
def test_readme_describes_all_files_and_the_import(name: str, skin1: Subject, tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    pytest.importorskip("MaterialX")
    target, suffix = TARGETS[name], "" if "" in TARGETS[name].suffixes else TARGETS[name].suffixes[0]
    if name in ("maps", "web"):  # these need heads
        described = {"maps": "maps.json", "web": "page.html"}[name]
        page, names = "\n".join(guide_lines(target, skin1, [Path(described)], "")), [described]
    else:
        report = export_skin(skin1, name, tmp_path / f"ball{suffix}")
        pages = [file for file in report.files if file.suffix == ".md"]
        page = pages[0].read_text("utf-8")
        names = [file.relative_to(pages[0].parent).as_posix() for file in report.files if file not in pages]
    rows = table_rows(page)
    similar = [int(number) for number in re.findall(r"and (\d+) more like it", page)]
    assert set(rows) <= set(names) and len(rows) + sum(similar) == len(names) and all(rows.values())
    steps = [line for line in page.splitlines() if line[:1].isdigit() and line[1:3] == ". "]
    assert [step[0] for step in steps] == ["1", "2", "3"]
    sections = [line for line in page.splitlines() if line.startswith("## ")]
    assert sections == [
        "## Files",
        f"## Import into {target.title}",
        "## Licence",
        "## Parameters and errors",
    ]
    assert ("Not run in" in page) == target.untested


def test_readme_has_a_picture_and_a_licence(tmp_path: Path) -> None:
    head = write_head(tmp_path / "face.obj")
    report = export_skin(head, "gltf", tmp_path / "a.glb", side=256, adapter="cpu", picture_width=64)
    picture = next(file for file in report.files if file.suffix == ".png")
    assert picture.name == "a.glb.preview.png" and png_size(picture.read_bytes())[:2] == (64, 64)
    page = (tmp_path / "a.glb.md").read_text("utf-8")
    assert f"]({picture.name})" in page and "as its owner states" in page
    assert "MakeHuman" not in page


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """Return a head from a file, without morph targets and bones."""
    return load_subject(write_head(tmp_path_factory.mktemp("scan") / "my face.obj"))


@pytest.mark.parametrize("name", list(TARGETS))
def test_steps_name_nothing_that_a_scan_lacks(name: str, scan: Subject) -> None:
    files = [Path("a.py"), Path("SK_my_face_LOD0.glb")] if name == "unreal" else [Path("a.glb")]
    text = " ".join(TARGETS[name].steps(scan, files))
    for absent in ("NAME", "LOD1", "52 morph", "bones", "shape keys", "variant set", "skin.py"):
        assert absent not in text
    if name == "unity":
        assert "`a`" in text and "`head`" in text and "`my_face_Skin`" in text
    if name == "unreal":
        assert "select `a.py`" in text and "`SK_my_face_LOD0`" in text


def test_steps_of_a_person_name_expressions_bones_and_levels() -> None:
    person = load_subject("human", subdivide=0)
    files = [Path("human.py"), Path("SK_human_LOD0.glb"), Path("SK_human_LOD1.glb")]
    texts = {name: " ".join(TARGETS[name].steps(person, files)) for name in TARGETS}
    assert "the 52 morph targets of the mesh `head`, which have the names of ARKit" in texts["gltf"]
    assert "bones" in texts["gltf"] and "variant set `expression`" in texts["usd"]
    assert "shape keys" in texts["blender"] and "bones" in texts["blender"]
    assert "`SK_human_LOD1`" in texts["unity"] and "`SK_human_LOD1`" in texts["unreal"]


def test_steps_name_the_written_file(skin1: Subject) -> None:
    assert "blender --python 'my skin.py'" in TARGETS["blender"].steps(skin1, [Path("my skin.py")])[0]
    assert "python" not in TARGETS["blender"].steps(skin1, [Path("a.blend")])[0]
    assert "pbrt a.pbrt" in TARGETS["pbrt"].steps(skin1, [Path("a.pbrt"), Path("b.ply")])[1]
    assert "MI_skin1" in TARGETS["unreal"].steps(skin1, [Path("a.py")])[2]


def test_names_with_spaces_are_links(skin1: Subject) -> None:
    page = "\n".join(guide_lines(TARGETS["gltf"], skin1, [Path("a|b.glb")], "my a.glb.preview.png"))
    assert "](my%20a.glb.preview.png)" in page and "`a\\|b.glb`" in page


def test_picture_has_a_small_atlas(scan: Subject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An atlas of 1024 texels suffices for a small picture; the default of 2048 would double its time."""
    sides = list[int]()

    def rendered(scene: object, *, atlas: int, **settings: object) -> np.ndarray:
        sides.append(atlas)
        return np.zeros((8, 8, 3), np.float32)

    monkeypatch.setattr("dermis.frame.renderer.render", rendered)
    write_preview(scan, tmp_path / "a.png", 320, "cpu")
    assert sides == [1024] and (tmp_path / "a.png").is_file()


def test_similar_files_share_a_row(skin1: Subject) -> None:
    files = [Path(f"a_hair_{number}.pbrt") for number in range(12)]
    rows = [line for line in guide_lines(TARGETS["pbrt"], skin1, files, "") if line.startswith("| `")]
    assert rows == ["| `a_hair_0.pbrt` and 11 more like it | hairs with similar absorption |"]


def test_roughness_of_a_target_has_its_own_meaning() -> None:
    def meaning(target: Target) -> str:
        return file_meaning(target, "human_roughness.png")

    assert "square root" in meaning(TARGETS["usd"]) and "square root" not in meaning(TARGETS["unreal"])
