"""The wheel renders when it is installed outside the checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from small_head import write_head

ROOT = Path(__file__).resolve().parents[1]
ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
WHERE = "import dermis, json, sys; print(json.dumps([dermis.__file__, *sys.path]))"

pytestmark = pytest.mark.skipif(not (ROOT / "pyproject.toml").is_file(), reason="this is no checkout")


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an environment with only the wheel; its dependencies are those of the tests."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input"]
    offline = ["--no-deps", "--no-index", "--quiet"]
    run([*pip, "wheel", *offline, "--no-build-isolation", "-w", str(folder), str(ROOT)], folder)
    (wheel,) = folder.glob("dermis-*.whl")
    venv.create(folder / "env", symlinks=os.name != "nt")
    python = str(binaries(folder / "env") / "python")
    run([*pip, "--python", python, "install", *offline, str(wheel)], folder)
    packages = run([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], folder).strip()
    # A path that a .pth file adds comes last, and the .pth files there, of an editable install, are not read.
    (Path(packages) / "dependencies.pth").write_text(
        "\n".join({sysconfig.get_path("purelib"), sysconfig.get_path("platlib")})
    )
    return folder


def test_installed_wheel_renders(empty: Path) -> None:
    write_head(empty / "head.obj")
    command = str(binaries(empty / "env") / "dermis")
    small = ["--size", "32x32", "--atlas", "64", "--samples", "1"]
    quick = ["--seams", "alpha", "--transmission", "none"]  # others compile loops for half a minute
    run([command, "render", "head.obj", *small, *quick, "--adapter", ADAPTER, "-o", "head.png"], empty)
    image = np.asarray(Image.open(empty / "head.png"))
    assert image.shape == (32, 32, 3) and np.ptp(image) > 50


def test_wheel_does_not_import_from_the_checkout(empty: Path) -> None:
    python = str(binaries(empty / "env") / "python")
    home, *path = json.loads(run([python, "-c", WHERE], empty))
    assert Path(home).is_relative_to(empty)
    assert not [entry for entry in path if Path(entry).is_relative_to(ROOT) and "site-packages" not in entry]


def test_wheel_contains_all_data_files(empty: Path) -> None:
    """Shaders, tables, presets, and the scripts of the gallery."""
    python = str(binaries(empty / "env") / "python")
    installed = Path(json.loads(run([python, "-c", WHERE], empty))[0]).parent
    here = {path.relative_to(ROOT / "src" / "dermis") for path in (ROOT / "src" / "dermis").rglob("*.*")}
    there = {path.relative_to(installed) for path in installed.rglob("*.*")}
    assert {path for path in here if "__pycache__" not in path.parts} <= there
    assert {path.name for path in (ROOT / "gallery").glob("*.py")} == {
        path.name for path in there if path.parent == Path("apps/gallery/scripts") and path.suffix == ".py"
    }


def binaries(environment: Path) -> Path:
    return environment / ("Scripts" if os.name == "nt" else "bin")


def run(words: list[str], folder: Path) -> str:
    """Return the output of a command, run in that folder with a cache there."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    kept["DERMIS_CACHE"] = str(folder / "cache")
    ended = subprocess.run(words, cwd=folder, env=kept, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout
