"""`dermis render` of a small head: files, output, and precedence of file and option."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.images.colour import encode_srgb8
from dermis.images.io import read_image, write_png

Run = Callable[..., Any]
STAGES = {
    "background",
    "shape",
    "stretch",
    "shadows",
    "irradiance",
    "diffuse",
    "surface",
    "pairs",
    "translucency",
    "combine",
    "visibility",
    "shade",
    "post",
    "total",
}
KEYS = [
    "image",
    "adapter",
    "size",
    "atlas",
    "subdivide",
    "triangles",
    "exposure",
    "gaussians",
    "gpu_ms",
    "frame_ms",
    "setup_ms",
]
SCENE = """
lights = "studio"
camera = "profile"

[head]
name = "head.obj"

[skin]
mix = 0.25

[render]
size = [48, 32]
atlas = 64
samples = 1
"""


def test_json_is_one_object_with_the_promised_keys(render: Run, device: Any) -> None:
    ended = render("head.obj", "-o", "a.png", "--json", "--exposure", "0.5")
    assert (ended.code, ended.stderr) == (0, "")
    report = json.loads(ended.stdout)  # which refuses anything before or after the object
    assert list(report) == KEYS
    assert (report["image"], report["size"], report["atlas"], report["gaussians"]) == (
        "a.png",
        [64, 64],
        64,
        6,
    )
    assert report["adapter"] == device.adapter.name
    assert report["frame_ms"] > 0 and report["setup_ms"] > 0
    if device.has_timestamps:
        times = report["gpu_ms"]
        assert set(times) == STAGES
        assert sum(times.values()) == pytest.approx(2 * times["total"], rel=1e-6)
        assert 0 < times["total"] <= report["frame_ms"]
    else:
        assert report["gpu_ms"] is None


def test_png_and_exr_show_the_same_picture(render: Run) -> None:
    assert render("head.obj", "-o", "a.png").code == 0
    assert render("head.obj", "-o", "a.exr").code == 0
    png, exr = read_image("a.png"), read_image("a.exr")
    assert png.shape == exr.shape == (64, 64, 3)
    assert (png.dtype, exr.dtype) == (np.uint8, np.float32)
    assert exr.max() > 0.05 and np.isfinite(exr).all()
    assert np.abs(encode_srgb8(exr).astype(int) - png.astype(int)).max() <= 1


def test_without_json_one_line_names_image_time_and_adapter(render: Run, device: Any) -> None:
    ended = render("head.obj", "-o", "a.png", "--exposure", "0.5")
    assert ended.stderr == ""
    assert ended.stdout.startswith("a.png  ") and ended.stdout.count("\n") == 1
    assert " s on " in ended.stdout and device.adapter.name in ended.stdout


def test_output_is_dermis_png_when_left_out(render: Run, folder: Path) -> None:
    before = {p.name for p in folder.iterdir()}
    assert render("head.obj").code == 0
    assert {p.name for p in folder.iterdir()} - before == {"dermis.png"}


def test_an_older_picture_is_replaced(render: Run) -> None:
    Path("a.png").write_bytes(b"old")
    assert render("head.obj", "-o", "a.png").code == 0
    assert read_image("a.png").shape == (64, 64, 3)


def _linear(render: Run, *words: str) -> np.ndarray:
    assert render("head.obj", "-o", "a.exr", *words).code == 0
    return np.asarray(read_image("a.exr"))


def test_options_reach_the_picture(render: Run) -> None:
    plain = _linear(render)
    covered = plain.sum(axis=2) > 0
    assert 0.1 < covered.mean() < 0.9
    np.testing.assert_allclose(_linear(render, "--exposure", "2"), 2 * plain, rtol=1e-5, atol=1e-6)
    assert _linear(render, "--background", "0,0.5,0")[0, 0].tolist() == [0, 0.5, 0]
    dull = _linear(render, "--rho-s", "0")
    assert (dull[covered] != plain[covered]).mean() > 0.5
    dry = _linear(render, "--technique", "none")
    assert np.abs(dry - plain)[covered].max() > 1e-3
    assert not np.array_equal(_linear(render, "--camera", "profile"), plain)
    skin_coloured = _linear(render, "--albedo", "profile")[covered].mean(axis=0)
    assert skin_coloured[0] > skin_coloured[1] > skin_coloured[2]


def test_maps_reach_the_picture(render: Run, folder: Path) -> None:
    red = np.zeros((16, 16, 3), np.uint8)
    red[..., 0] = 200
    write_png(folder / "red.png", red)
    picture = _linear(render, "--colour", "red.png", "--rho-s", "0")
    assert picture[..., 0].max() > 0.05 and picture[..., 1:].max() < 1e-6
    grain = np.random.default_rng(1).integers(0, 255, (64, 64), dtype=np.uint8)
    write_png(folder / "grain.png", grain)
    rough = _linear(render, "--height", "grain.png", "--height-mm", "0.02", "--rho-s", "1")
    assert not np.array_equal(rough, _linear(render, "--rho-s", "1"))


def test_up_and_unit_turn_and_scale_the_same_head(render: Run, folder: Path) -> None:
    lines = Path("head.obj").read_text().splitlines()
    cells = [line.split() for line in lines]
    turned = [
        f"v {float(c[1]) / 10} {-float(c[3]) / 10} {float(c[2]) / 10}" if c[0] == "v" else " ".join(c)
        for c in cells
    ]
    Path("turned.obj").write_text("\n".join(turned))
    expected = _linear(render)
    assert render("turned.obj", "-o", "b.exr", "--up", "z", "--unit-mm", "10").code == 0
    assert np.median(np.abs(read_image("b.exr") - expected)) < 1e-3


def test_scene_file_is_taken_as_written(run: Run, render: Run, folder: Path) -> None:
    Path("s.toml").write_text(SCENE)
    assert run("render", "s.toml", "-o", "a.exr").code == 0
    words = ("--size", "48x32", "--atlas", "64", "--samples", "1", "--mix", "0.25", "--camera", "profile")
    assert run("render", "head.obj", *words, "-o", "b.exr").code == 0
    assert read_image("a.exr").shape == (32, 48, 3)
    np.testing.assert_array_equal(read_image("a.exr"), read_image("b.exr"))


def test_options_override_a_scene_file(run: Run, render: Run, folder: Path) -> None:
    Path("s.toml").write_text(SCENE)
    ended = run(
        "render", "s.toml", "-o", "a.exr", "--size", "64x64", "--mix", "0.5", "--camera", "portrait", "--json"
    )
    report = json.loads(ended.stdout)
    assert (report["size"], report["atlas"]) == ([64, 64], 64)
    np.testing.assert_array_equal(read_image("a.exr"), _linear(render, "--samples", "1"))
