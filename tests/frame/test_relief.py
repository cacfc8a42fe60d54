"""Normals and roughness from height and normal maps against the slopes of their source."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import bent_plane, frontal, head_of, probe, run_frame, scene_of
from tolerances import MAP_NORMAL, TWIN

from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import plane

Floats = NDArray[np.float64]
SIZE = 64
SIDE = 50.0  # of the plane [mm]
INNER = slice(3, SIZE - 3)  # the map's border has its own rule for slopes


def relief(renderer: Renderer, head: Head, *, texels: float = 1.0, roughness: float = 0.3) -> Any:
    """Return the normals (n, n, 3) and the roughness (n, n), filtered over a number of atlas texels."""
    scene = scene_of(head, frontal(), roughness=roughness, specular="torrance-sparrow")
    inputs = run_frame(renderer, scene, atlas=SIZE)
    made, _ = probe(
        renderer.device,
        "surface_probe",
        (SIZE, SIZE),
        ["relief", "arriving"],
        **inputs.bindings,
        atlas=inputs.layouts[0].atlas.resources["atlas"],
        footprint={"side": texels / SIZE},
    )
    return made[..., :3], made[..., 3]


def normal_of(slope_x: Any, slope_y: Any) -> Floats:
    """Return the unit normals of a surface z = h(x, y), seen along -Z with y upwards."""
    x, y = np.broadcast_arrays(np.asarray(slope_x, float), np.asarray(slope_y, float))
    n = np.stack([-x, -y, np.ones(x.shape)], axis=-1)
    return np.asarray(n / np.linalg.norm(n, axis=-1, keepdims=True))


def xy(size: int, side: float = SIDE) -> tuple[Floats, Floats]:
    """Return the positions of a map's texel centres on the plane [mm]: columns along +x, rows along -y."""
    along = (np.arange(size) + 0.5) / size
    return np.meshgrid(side * (along - 0.5), side * (0.5 - along))


TILTS = [(0.3, 0.0), (-0.3, 0.0), (0.0, 0.3), (0.0, -0.3), (0.2, -0.4)]


@pytest.mark.parametrize("tilt", TILTS)
def test_height_map_of_a_tilted_plane_gives_its_normal(renderer: Renderer, tilt: tuple[float, float]) -> None:
    x, y = xy(SIZE)
    normal, roughness = relief(renderer, head_of(plane(SIDE), height=tilt[0] * x + tilt[1] * y))
    assert np.abs(normal - normal_of(*tilt))[INNER, INNER].max() < MAP_NORMAL
    assert np.abs(roughness - 0.3).max() < 1e-3  # an even slope is no roughness


@pytest.mark.parametrize("tilt", TILTS)
def test_normal_map_of_a_tilted_plane_gives_its_normal(renderer: Renderer, tilt: tuple[float, float]) -> None:
    slopes = np.broadcast_to(np.array(tilt), (SIZE, SIZE, 2))
    normal, roughness = relief(renderer, head_of(plane(SIDE), normal=slopes))
    assert np.abs(normal - normal_of(*tilt)).max() < MAP_NORMAL
    assert np.abs(roughness - 0.3).max() < 1e-3


def waves(size: int, side: float = SIDE) -> tuple[Floats, Floats, Floats]:
    """Return a sine relief [mm] with its slopes along +x and +y."""
    x, y = xy(size, side)
    k, q = 2 * np.pi * 3 / side, 2 * np.pi * 2 / side
    height = 0.5 * np.sin(k * x) + 0.8 * np.cos(q * y)
    return height, 0.5 * k * np.cos(k * x), -0.8 * q * np.sin(q * y)


@pytest.mark.parametrize("map_size", [SIZE, 4 * SIZE])
def test_height_map_of_a_sine_gives_its_normals(renderer: Renderer, map_size: int) -> None:
    height, _, _ = waves(map_size)
    _, slope_x, slope_y = waves(SIZE)
    normal, _ = relief(renderer, head_of(plane(SIDE), height=height))
    wide = (
        2 * np.pi * 3 / min(map_size, SIZE)
    ) ** 2 / 6  # differences over two texels flatten a sine so much
    off = np.abs(normal - normal_of(slope_x, slope_y))[INNER, INNER].max()
    assert off < MAP_NORMAL + wide * np.abs(slope_x).max()


def test_normal_map_of_a_sine_gives_its_normals(renderer: Renderer) -> None:
    _, slope_x, slope_y = waves(SIZE)
    normal, _ = relief(renderer, head_of(plane(SIDE), normal=np.stack([slope_x, slope_y], axis=-1)))
    assert np.abs(normal - normal_of(slope_x, slope_y)).max() < MAP_NORMAL


LAYOUTS: dict[str, Mesh] = {
    "narrow": bent_plane(SIDE, [[1, 0, 0], [0, 0.5, 0.2]]),
    "turned": bent_plane(SIDE, [[0, 1, 0], [-1, 0, 1]]),
    "mirrored": bent_plane(SIDE, [[-1, 0, 1], [0, 1, 0]]),
    "skewed": bent_plane(SIDE, [[0.6, 0.3, 0], [0.1, 0.7, 0.1]]),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_height_map_works_under_any_uv_layout(renderer: Renderer, name: str) -> None:
    """A hill in the map is a hill on the surface: its normal is that of h(uv(x, y))."""
    mesh = LAYOUTS[name]
    v, u = (np.mgrid[:SIZE, :SIZE] + 0.5) / SIZE
    hill = 3.0 * np.exp(-((u - 0.5) ** 2 + (v - 0.5) ** 2) / 0.06)
    dh_du, dh_dv = -2 * (u - 0.5) / 0.06 * hill, -2 * (v - 0.5) / 0.06 * hill
    jacobian = np.linalg.lstsq(
        np.c_[mesh.positions[:, :2], np.ones(len(mesh.uv))].astype(float), mesh.uv.astype(float), rcond=None
    )[0][:2]  # rows: d(u, v) / dx, d(u, v) / dy
    expected = normal_of(
        *(jacobian @ np.stack([dh_du, dh_dv], axis=-1)[..., None])[..., 0].transpose(2, 0, 1)
    )
    normal, _ = relief(renderer, head_of(mesh, height=hill))
    inside = _inside(mesh)
    assert inside.sum() > 500
    assert np.abs(normal - expected)[inside].max() < 0.01


def _inside(mesh: Mesh) -> NDArray[np.bool_]:
    """Return the texels well inside the plane's parallelogram of uv."""
    v, u = (np.mgrid[:SIZE, :SIZE] + 0.5) / SIZE
    places = np.c_[mesh.uv.astype(float), np.ones(len(mesh.uv))]
    back = np.linalg.lstsq(places, mesh.positions[:, :2].astype(float), rcond=None)[0]
    x, y = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3).dot(back).T.reshape(2, SIZE, SIZE)
    return np.asarray(np.maximum(np.abs(x), np.abs(y)) < 0.4 * SIDE)


def test_two_maps_of_one_relief_count_once(renderer: Renderer) -> None:
    height, _, _ = waves(4 * SIZE)
    _, slope_x, slope_y = waves(SIZE)
    slopes = np.stack([slope_x, slope_y], axis=-1)
    both, _ = relief(renderer, head_of(plane(SIDE), normal=slopes, height=height))
    assert np.abs(both - normal_of(slope_x, slope_y))[INNER, INNER].max() < 0.01


def test_fine_height_adds_to_a_coarse_normal_map(renderer: Renderer) -> None:
    """A height map eight times finer has waves of one texel of the normal map."""
    column = np.arange(8 * SIZE)
    pores = np.broadcast_to(0.01 * np.sin(2 * np.pi * (column - 3.5) / 8), (8 * SIZE, 8 * SIZE))
    slopes = np.full((SIZE, SIZE, 2), 0.1)
    normal, _ = relief(renderer, head_of(plane(SIDE), normal=slopes, height=pores), texels=1 / 8)
    # an atlas texel's centre lies between the columns 3 and 4 of its 8
    steepest = 0.01 * np.sin(2 * np.pi / 8) * np.cos(np.pi / 8) * 8 * SIZE / SIDE
    assert steepest > 0.05
    assert np.abs(normal - normal_of(0.1 + steepest, 0.1))[INNER, INNER].max() < 2 * MAP_NORMAL


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("slope", [0.1, 0.4])
def test_subpixel_slopes_become_roughness(renderer: Renderer, slope: float, axis: int) -> None:
    """Stripes of +s and -s under a footprint of two texels: no tilt, and a lobe wider by s."""
    stripes = np.zeros((SIZE, SIZE, 2))
    stripes[..., axis] = slope * (1 - 2 * (np.indices((SIZE, SIZE))[1 - axis] % 2))
    head = head_of(plane(SIDE), normal=stripes)
    sharp, narrow = relief(renderer, head, texels=1.0)
    assert np.abs(np.abs(sharp[..., axis]) - np.abs(normal_of(slope, 0)[0])).max() < 0.02
    smooth, wide = relief(renderer, head, texels=2.0)
    assert np.abs(smooth - [0, 0, 1])[INNER, INNER].max() < 0.01
    assert np.allclose(wide[INNER, INNER], np.hypot(0.3, slope), rtol=0.005)
    assert np.median(narrow) < wide[INNER, INNER].min()


def test_subpixel_height_becomes_roughness(renderer: Renderer) -> None:
    """Ridges of 4 texels have slopes of +s, 0, -s, 0, whose variance widens the lobe."""
    ridges = np.tile([0.0, 0.1, 0.0, -0.1], (4 * SIZE, SIZE))
    texel_mm = SIDE / (4 * SIZE)
    slopes = np.array([0.2, 0.0, -0.2, 0.0]) / (2 * texel_mm)
    normal, roughness = relief(renderer, head_of(plane(SIDE), height=ridges))
    assert np.abs(normal - [0, 0, 1])[INNER, INNER].max() < 0.01
    assert np.allclose(roughness[INNER, INNER], np.sqrt(0.09 + (slopes**2).mean()), rtol=0.01)


def test_no_maps_leave_the_smooth_normal(renderer: Renderer) -> None:
    normal, roughness = relief(renderer, head_of(plane(SIDE)))
    assert np.abs(normal - [0, 0, 1]).max() < TWIN
    assert np.abs(roughness - 0.3).max() < TWIN
