"""The house rules that a machine can hold."""

from __future__ import annotations

import ast
import io
import os
import re
import shutil
import subprocess
import sys
import tokenize
from pathlib import Path

import pytest

import dermis

ROOT = Path(__file__).resolve().parents[1]
SOURCE = Path(dermis.__file__).resolve().parent

VAGUE_NAMES = {"util", "utils", "helper", "helpers", "common", "misc"}
ENTRY_POINT = re.compile(r"@(compute|fragment|vertex)\b")
# A folder of one person's machine; the same words inside a URL or a longer path do not count.
MACHINE_PATH = re.compile(r"(?<![\w.:~/])/(?:work|home|root|Users|opt)/\w")
IMAGES = {".png", ".jpg", ".jpeg", ".gif", ".webp", ".exr", ".hdr", ".tif", ".tiff", ".bmp", ".ppm"}
IMAGE_BYTES = 10_000_000
# Words that only this project used. Others, such as "told", have normal uses and are left to review.
DIALECT = re.compile(
    r"(?<!-)\b(anew|goes? aside|at a slant|(is|are|was|were|be) told|when asked|what stands|by the clock)\b",
    re.IGNORECASE,
)
CODE = re.compile(r"```.*?```|`[^`]*`", re.DOTALL)


def python_files() -> list[Path]:
    return sorted(SOURCE.rglob("*.py"))


def shader_files() -> list[Path]:
    return sorted(SOURCE.rglob("*.wgsl"))


def name(path: Path) -> str:
    return path.relative_to(SOURCE).as_posix()


def tracked_files() -> list[Path]:
    """Return the files that git tracks or would add; skip the test outside a checkout."""
    git = shutil.which("git")
    if git is None:
        pytest.skip("git is missing")
    # A checkout may belong to another user than the one who runs the tests.
    command = [git, "-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listing = subprocess.run(command, cwd=ROOT, capture_output=True, check=False)
    if listing.returncode != 0:
        pytest.skip("not a git checkout")
    paths = [ROOT / os.fsdecode(line) for line in listing.stdout.split(b"\0") if line]
    return [path for path in paths if path.is_file()]


def read_text(path: Path) -> str:
    """Return the text of a file; an empty text for a binary file."""
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return ""


def prose(path: Path) -> str:
    """Return the comments and texts of a source file, or the text of a Markdown file without code."""
    text = read_text(path)
    if not DIALECT.search(text):  # reading tokens takes much longer
        return ""
    if path.suffix == ".md":
        return CODE.sub("", text)
    if path.suffix == ".wgsl":
        return "\n".join(line.partition("//")[2] for line in text.splitlines())
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    parts = [t.string for t in tokens if t.type in (tokenize.STRING, tokenize.COMMENT) and " " in t.string]
    return CODE.sub("", "\n".join(parts))


def test_no_module_has_a_vague_name() -> None:
    assert [name(p) for p in SOURCE.rglob("*") if p.stem.lower().strip("_") in VAGUE_NAMES] == []


def test_shaders_begin_with_what_they_compute() -> None:
    first = {name(p): next(iter(read_text(p).splitlines()), "") for p in shader_files()}
    silent = [file for file, line in first.items() if not re.match(r"//\s*[^#\s/]", line)]
    assert silent == []


def test_no_shader_text_in_python() -> None:
    guilty = [
        f"{name(path)}:{node.lineno}"
        for path in python_files()
        for node in ast.walk(ast.parse(read_text(path)))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and ENTRY_POINT.search(node.value)
    ]
    assert guilty == []


def test_no_local_path_is_tracked() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number} {line.strip()[:80]}"
        for path in tracked_files()
        for number, line in enumerate(read_text(path).splitlines(), start=1)
        if MACHINE_PATH.search(line)
    ]
    assert found == []


@pytest.mark.parametrize(
    ("line", "caught"),
    [
        ("see /" + "home/ann/heads", True),
        ('path = "/' + 'work/shared"', True),
        ("https://example.org/" + "home/ann", False),
        ("docs/" + "work/plan", False),
    ],
)
def test_local_paths_are_recognised(line: str, caught: bool) -> None:
    assert bool(MACHINE_PATH.search(line)) is caught


def test_tracked_images_are_small() -> None:
    sizes = {p.relative_to(ROOT): p.stat().st_size for p in tracked_files() if p.suffix.lower() in IMAGES}
    assert sum(sizes.values()) < IMAGE_BYTES, sorted(sizes.items(), key=lambda item: -item[1])[:5]


def test_prose_is_plain_english() -> None:
    found = {
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path in tracked_files()
        if path.suffix in {".py", ".wgsl", ".md"} and path.name != Path(__file__).name
        for match in DIALECT.finditer(prose(path))
    }
    assert sorted(found) == []


@pytest.mark.parametrize("name", ["requirements.lock", "requirements-dev.lock"])
def test_lock_names_no_package_index(name: str) -> None:
    lock = (ROOT / name).read_text(encoding="utf-8")
    assert "numpy==" in lock and "--hash=sha256:" in lock
    assert not re.search(r"://|--(extra-)?index-url|--find-links", lock)


def test_importing_dermis_loads_few_modules() -> None:
    code = "import dermis, sys; print([m for m in ('wgpu', 'trimesh', 'scipy') if m in sys.modules])"
    environment = {**os.environ, "PYTHONPATH": str(SOURCE.parent)}
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True
    )
    assert run.stdout.strip() == "[]"
