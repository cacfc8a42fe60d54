"""Levels of subdivision by the smoothness of the outline in a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_head import write_head

import dermis
from dermis.base.errors import DermisError
from dermis.cli.scene_options import SceneOptions, assemble_scene, note_subdivision
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene.camera import Camera, portrait
from dermis.scene.smoothness import (
    MAX_SILHOUETTE_DEVIATION_PX,
    MAX_SMOOTH_TRIANGLES,
    Silhouette,
    SmoothOutlineLevels,
    silhouette,
    smooth_subdivision_levels,
)

RADIUS_MM, SIDES = 120.0, 24
SIZES = {64: 0, 256: 1, 1024: 2}
"""Levels of a ball of 24 by 12 faces, by the side of its portrait."""


def ball(sides: int = SIDES) -> Head:
    return Head("ball", uv_sphere(RADIUS_MM, sides, sides // 2), Maps())


def seen(head: Head, camera: Camera, side: int) -> Silhouette:
    K, R, t = camera.to_opencv((side, side))
    return silhouette(head.mesh, K, R, t - R @ np.array(head.centre_mm), (side, side))


def test_polygon_deviates_from_its_circle_by_the_sagitta() -> None:
    distance, head = 1e5, ball()
    from_above = Camera(position=(0.0, distance, 0.0), up=(0.0, 0.0, 1.0), frame_mm=300.0)
    found = seen(head, from_above, 1000)
    scale = 1000 / 300.0
    assert np.allclose(found.length_px, 2 * RADIUS_MM * np.sin(np.pi / SIDES) * scale, rtol=0.01)
    assert np.allclose(found.deviation_px, RADIUS_MM * (1 - np.cos(np.pi / SIDES)) * scale, rtol=0.02)


def test_outline_deviation_is_weighted_by_length() -> None:
    found = Silhouette(np.array([90.0, 4.0, 6.0]), np.array([0.5, 2.0, 9.0]))
    assert found.typical_deviation_px == 0.5
    assert Silhouette(np.zeros(0), np.zeros(0)).typical_deviation_px == 0.0


@pytest.mark.parametrize("side", SIZES)
def test_levels_grow_with_the_picture(side: int) -> None:
    assert SmoothOutlineLevels(portrait, (side, side))(ball()) == SIZES[side]


def test_levels_grow_as_the_camera_comes_near() -> None:
    size = 512, 512
    near = Camera(position=(120.0, 0.0, 400.0), target=(120.0, 0.0, 0.0), frame_mm=40.0)
    assert SmoothOutlineLevels(lambda head: near, size)(ball()) > SmoothOutlineLevels(portrait, size)(ball())


def test_fine_heads_are_unchanged_and_size_is_limited() -> None:
    assert SmoothOutlineLevels()(ball(128)) == 0
    assert smooth_subdivision_levels(1e3, 1000) == 3
    for triangles in (5_000, 50_000, 80_000, 500_000):
        levels = smooth_subdivision_levels(1e3, triangles)
        assert levels == 0 or triangles * 4**levels <= MAX_SMOOTH_TRIANGLES
    assert smooth_subdivision_levels(1e3, 80_000) == 0


def test_coarse_outline_becomes_smooth(tmp_path: Path) -> None:
    path = write_head(tmp_path / "head.obj")
    coarse, smooth = (
        seen(head, portrait(head), 1024)
        for head in (dermis.load_head(path, subdivide=0), dermis.load_head(path))
    )
    assert coarse.typical_deviation_px > 2 * MAX_SILHOUETTE_DEVIATION_PX > 2 * smooth.typical_deviation_px
    assert coarse.length_px.max() > 70
    assert smooth.length_px.max() < 25


def test_head_without_picture_size_assumes_a_portrait(tmp_path: Path) -> None:
    path = write_head(tmp_path / "head.obj")
    plain = dermis.load_head(path, subdivide=0)
    assert plain.levels == 0
    assert dermis.load_head(path).levels == SmoothOutlineLevels()(plain) > 0
    assert dermis.load_head(path, subdivide=2).levels == 2
    with pytest.raises(DermisError, match="subdivide: expected auto or 0 to 3 levels, but got 'most'"):
        dermis.load_head(path, subdivide="most")  # type: ignore[arg-type]


def test_people_keep_their_subdivision_level() -> None:
    assert dermis.load_head("human").levels == 1
    assert dermis.load_head("human", subdivide=SmoothOutlineLevels(size=(16, 16))).levels == 1


def test_picture_size_of_options_and_files_sets_the_level(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, scene = write_head(tmp_path / "head.obj"), tmp_path / "scene.toml"
    scene.write_text('camera = "portrait"\n[head]\nname = "head.obj"\n[render]\nsize = [64, 64]\n')

    def levels(name: Path, side: int | None = None, **head: object) -> int:
        sized = {"background": (0, 0, 0)} | ({"size": (side, side)} if side else {})
        given = SceneOptions(settings=sized, head=head)
        made = assemble_scene(str(name), given)[0].head
        note_subdivision(str(name), given, made)
        return made.levels

    assert levels(scene) == levels(path, 64) == 0
    assert not capsys.readouterr().err
    assert levels(scene, 1024) == levels(path, 1024) == 2
    assert "--subdivide 2 for a smooth outline in this picture: 8,448 triangles" in capsys.readouterr().err
    assert levels(path, 64, subdivide=1) == 1
    assert not capsys.readouterr().err
