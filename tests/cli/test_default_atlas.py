"""The default of `--atlas` on software adapters follows from the picture."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from small_head import write_head

from dermis.cli.render import render
from dermis.cli.scene_options import SceneOptions, shrink_atlas_on_cpu
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene.camera import Camera
from dermis.scene.model import Scene
from dermis.scene.resolved_atlas import atlas_side_for_picture
from dermis.scene.settings import Settings

RADIUS_MM = 100.0
NOTE = "note: --atlas 1024 without a GPU, as the picture resolves no more texels\n"


def ball(frame_mm: float = 340.0) -> Scene:
    head = Head("ball", uv_sphere(RADIUS_MM, 48, 24), Maps())
    return Scene(head, camera=Camera(position=(0, 0, 1100), frame_mm=frame_mm))


def test_side_has_a_texel_for_three_pixels() -> None:
    # 4 pi 100^2 mm2 in half of the atlas: 501 texels for one per mm; 1024 texels for 6.13 pixels per mm
    assert atlas_side_for_picture(ball(170.0), Settings(size=(700, 1040))) == 1024
    assert atlas_side_for_picture(ball(170.0), Settings(size=(700, 1060))) == 2048
    assert atlas_side_for_picture(ball(85.0), Settings(size=(700, 520))) == 1024


def test_side_is_at_most_that_of_the_settings() -> None:
    assert atlas_side_for_picture(ball(10.0), Settings()) == Settings().atlas
    assert atlas_side_for_picture(ball(), Settings(atlas=256)) == 256


def test_gpus_keep_the_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert shrink_atlas_on_cpu(ball(), Settings(size=256), "DiscreteGPU").atlas == Settings().atlas
    assert capsys.readouterr().err == ""


def test_given_sides_are_kept(capsys: pytest.CaptureFixture[str]) -> None:
    assert shrink_atlas_on_cpu(ball(), Settings(size=256, atlas=2048), "CPU").atlas == 2048
    assert capsys.readouterr().err == ""


def test_software_adapters_note_the_side(capsys: pytest.CaptureFixture[str]) -> None:
    assert shrink_atlas_on_cpu(ball(), Settings(size=256), "CPU").atlas == 1024
    assert (
        capsys.readouterr().err
        == "note: --atlas 1024 without a GPU, as the picture resolves no more texels\n"
    )
    assert shrink_atlas_on_cpu(ball(), Settings(size=256, technique="none"), "CPU").atlas == 1024
    assert capsys.readouterr().err == ""  # this technique has no atlas


@pytest.mark.skipif(os.environ.get("DERMIS_TEST_ADAPTER", "cpu") != "cpu", reason="the adapter is a GPU")
def test_command_reports_the_side(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_head(tmp_path / "head.obj")
    small = {"size": (32, 32), "samples": 1, "seams": "alpha", "transmission": "none"}
    options, picture = SceneOptions(settings=small), tmp_path / "head.png"
    render(str(tmp_path / "head.obj"), output=picture, scene=options, adapter="cpu", as_json=True)
    assert json.loads(capsys.readouterr().out)["atlas"] == 1024
