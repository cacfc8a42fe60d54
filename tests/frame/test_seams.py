"""Light across the seams of a map in the frame: stitched, and with the methods of the talk."""

from __future__ import annotations

import numpy as np
import pytest
from atlas_reading import lit_at, seam_points
from cut_meshes import cut_sphere
from numpy.typing import NDArray
from setups import head_of, place, run_frame, scene_of
from tolerances import SEAM

from dermis.atlas.build import cached_atlas
from dermis.frame.renderer import Renderer
from dermis.frame.seams import SEAM_METHODS
from dermis.gpu import download
from dermis.scene.lights import DirectionalLight, StripeLight
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
SIZE = 320
BALL = cut_sphere(30.0, 20)
HEAD = head_of(BALL)


def striped() -> Scene:
    """Return bands of light with hard ends that cross the seams of the face, and some uniform light."""
    bands = [
        StripeLight(
            direction=(0, 0, -1),
            position=place(HEAD, (x, 0.3 * x, 60)),
            up=(0.4, 1, 0),
            width_mm=6,
            shadows=False,
        )
        for x in (-16, -4, 8)
    ]
    around = DirectionalLight(direction=(0, 0, -1), irradiance=(1, 1, 1), shadows=False)
    return scene_of(HEAD, *bands, around, rho_s=0.0, albedo="profile")


def jumps(renderer: Renderer, seams: str) -> Floats:
    """Return the relative change of the scattered light across each seam."""
    inputs = run_frame(renderer, striped(), atlas=SIZE, seams=seams, transmission="none")
    light = download(renderer.device, inputs.resources.scattered).astype(float)[..., :3]
    atlas = cached_atlas(BALL, SIZE, SEAM_METHODS[seams].layouts[0])
    one, other = seam_points(BALL)
    a, b = (lit_at(light, atlas, points) for points in (one, other))
    facing = one.on(BALL.normals[BALL.triangles])[:, 2] > 0.4
    red = np.stack([a[facing, 0], b[facing, 0]])
    return np.asarray(np.abs(red[0] - red[1]) / red.mean(axis=0))


def test_stitched_light_has_no_seams(renderer: Renderer) -> None:
    stitched = jumps(renderer, "stitch")
    assert stitched.mean() < 0.5 * SEAM and np.percentile(stitched, 95) < SEAM


@pytest.mark.parametrize("seams", [name for name in SEAM_METHODS if name != "stitch"])
def test_gutters_alone_leave_seams(renderer: Renderer, seams: str) -> None:
    """The methods look less bad than black beside each chart, but leave seams."""
    assert np.percentile(jumps(renderer, seams), 90) > 3 * SEAM


@pytest.mark.parametrize("technique", ["texture-space", "gpu-gems-3"])
def test_black_bleeds_in_without_gutters(renderer: Renderer, technique: str) -> None:
    """Compare the darkest light at the seams: each method is lighter than none."""
    darkest = {}
    for seams in ("none", "clear-colour", "stretch-map", "alpha"):
        chosen = {"atlas": SIZE, "seams": seams, "technique": technique, "transmission": "none"}
        inputs = run_frame(renderer, striped(), **chosen)
        light = download(renderer.device, inputs.resources.scattered).astype(float)[..., :3]
        one, _ = seam_points(BALL)
        facing = one.on(BALL.normals[BALL.triangles])[:, 2] > 0.4
        darkest[seams] = np.percentile(lit_at(light, cached_atlas(BALL, SIZE), one)[facing, 0], 10)
    assert darkest["none"] == min(darkest.values())
    assert darkest["alpha"] > 1.05 * darkest["none"]


def test_the_second_layout_hides_seams_of_the_first(renderer: Renderer) -> None:
    assert np.percentile(jumps(renderer, "multi-uv"), 75) < 0.5 * np.percentile(jumps(renderer, "alpha"), 75)
