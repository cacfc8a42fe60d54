"""A picture needs no package of the extras, and features that need one name it."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import numpy as np
import pytest
from moving_head import write_moving_head
from png_bytes import png
from small_head import write_head

from dermis.base.errors import DermisError
from dermis.base.extras import EXTRAS, distribution_name, extra_advice, import_extra
from dermis.images.codecs import decode_with_pillow, encode_png
from dermis.images.io import read_image

SOURCE = Path(__file__).resolve().parents[1] / "src"
ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
WITHOUT = "import sys; sys.modules.update(dict.fromkeys({names}, None)); import dermis.cli; dermis.cli.main()"


def run(*options: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Return a function that runs the command without any extra."""
    code = WITHOUT.format(names=[*EXTRAS, "imgui_bundle", "uvicorn"])
    environment = {**os.environ, "PYTHONPATH": str(SOURCE)}
    return subprocess.run(
        [sys.executable, "-c", code, *options], capture_output=True, text=True, env=environment, cwd=folder
    )


def test_a_picture_needs_no_extra(tmp_path: Path) -> None:
    head = write_head(tmp_path / "head.obj")
    small = ("--size", "64x64", "--atlas", "128", "--shadow-size", "64", "--adapter", ADAPTER)
    made = run("render", str(head), *small, "-o", "a.png", folder=tmp_path)
    assert made.returncode == 0, made.stderr
    assert (tmp_path / "a.png").is_file()


@pytest.mark.parametrize(
    ("options", "extra"),
    [
        (("profile", "dj3", "--plot", "curve.png"), "plots"),
        (("animate", "face.glb", "-o", "turn.mp4"), "video"),
        (("profile", "skin1", "--model", "montecarlo", "--photons", "1000"), "truth"),
        (("gallery", "--only", "13_gaussians", "-o", "out"), "plots"),
    ],
)
def test_missing_package_error_names_the_extra(options: tuple[str, ...], extra: str, tmp_path: Path) -> None:
    write_moving_head(tmp_path / "face.glb")
    made = run(*options, folder=tmp_path)
    assert made.returncode == 2, made.stdout + made.stderr
    assert f'[{extra}]".' in " ".join(made.stderr.split()) and "Traceback" not in made.stderr


def test_picture_that_needs_an_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    average = 3  # of left and above, as this package does not write it
    (tmp_path / "deep.png").write_bytes(png(4, 4, 16, 2, bytes([average, *bytes(4 * 6)]) * 4))
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(DermisError, match=r"deep\.png: a picture with 16 bits of colour: expected .* av,"):
        read_image(tmp_path / "deep.png")


def test_each_extra_is_declared_by_the_package() -> None:
    text = (SOURCE.parent / "pyproject.toml").read_text("utf-8")
    for module, extra in EXTRAS.items():
        (line,) = [line for line in text.splitlines() if line.startswith(f"{extra} = [")]
        assert distribution_name(module) in line


def test_missing_package_is_named() -> None:
    sys.modules["matplotlib.nothing"] = None  # type: ignore[assignment]
    with pytest.raises(
        DermisError, match=r"plots: expected the package matplotlib, .* install .*\[plots\]\"\."
    ):
        import_extra("matplotlib.nothing", "plots")


def test_advice_runs_the_installer_of_this_interpreter(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another interpreter's pip could install a stranger's package of the same name."""
    monkeypatch.setattr(sys, "executable", "/my folder/bin/python")
    monkeypatch.setattr("dermis.base.extras.metadata.distribution", lambda name: None)
    assert extra_advice("plots") == 'Install it: "/my folder/bin/python" -m pip install "dermis[plots]"'
    monkeypatch.setattr("dermis.base.extras.find_spec", lambda name: None)
    assert extra_advice("plots").endswith('uv pip install --python "/my folder/bin/python" "dermis[plots]"')


def test_advice_without_an_installed_package_names_the_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("dermis.base.extras.metadata.distribution", missing)
    assert extra_advice("plots").endswith(f'install -e "{SOURCE.parent}[plots]"')


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_16_bit_pictures_round_trip_bit_for_bit(channels: int) -> None:
    levels = np.random.default_rng(1).integers(0, 65536, (9, 13, channels), np.uint16)
    np.testing.assert_array_equal(decode_with_pillow(encode_png(levels)).reshape(levels.shape), levels)
