"""A medium below painted skin: as far as light spreads in the mean, and for each place what it gives back."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject, rgb
from dermis.apps.truths.half_space import diffuse_albedo
from dermis.apps.truths.person.person import Person
from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.mesh.geometry import triangle_areas
from dermis.optics.media import SKIN_ETA
from dermis.scene.camera import Camera

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]

COAT_TRANSMITTANCE = 0.98
"""Share of light that the coat lets through, see `skin.coat`; the medium makes up for it."""
COAT_INDEX = SKIN_ETA
VOXELS = 96
"""Along the longest side of the grid of colours."""
_GRID_MARGIN, _MIN_HALF_SIDE_MM = 0.75, 25.0  # of the grid: over the height of the picture; least half of its side
_COLOUR_DEPTH_MM = 3.0  # from the surface, to which places have its colour
_SAMPLES_PER_VOXEL = 3.0  # samples of the surface for the square of a voxel's side
_MAX_COLOUR = 0.97
_MIN_ROOT = 0.01
_PHOTONS = 40_000


@cache
def _albedo_table() -> tuple[Doubles, Doubles]:
    """Return albedos of half-spaces, and the roots of their single-scattering absorption, in even steps."""
    root = np.linspace(1.0, _MIN_ROOT, 32)
    return np.array([diffuse_albedo(float(1.0 - one**2)) for one in root]), root


def single_scattering_albedo(colour: ArrayLike) -> Doubles:
    """Return the single-scattering albedo of half-spaces of a colour under uniform light [-]."""
    total, root = _albedo_table()
    wanted = np.clip(np.asarray(colour, np.float64) / COAT_TRANSMITTANCE, 0.0, _MAX_COLOUR)
    return np.asarray(1.0 - np.interp(wanted, total, root) ** 2)


def mean_free_paths(colour: ArrayLike, distance_mm: ArrayLike) -> Doubles:
    """Return mean free paths (3,) of media of a colour (3,) by the mean lateral offset (3,) of exits [mm].

    By photons, which fall in at right angles.
    """
    pairs = zip(single_scattering_albedo(colour), np.asarray(distance_mm, np.float64), strict=True)
    return np.array([distance / _mean_offset(round(float(albedo), 4)) for albedo, distance in pairs])


@cache
def _mean_offset(albedo: float) -> float:
    """Return the mean lateral offset of exit points, in mean free paths."""
    edges = np.concatenate([[0.0], np.geomspace(1e-3, 400.0, 120)])
    layer = ScatteringLayer(1.0 - albedo, albedo, eta=1.0)
    found = trace_slab([layer], _PHOTONS, edges_mm=edges).reflectance * np.pi * np.diff(edges**2)
    return float((found * 0.5 * (edges[1:] + edges[:-1])).sum() / found.sum())


def skin_medium(mi: Mitsuba, person: Person, camera: Camera, mean_free_path_mm: Doubles) -> MitsubaObject:
    """Return Mitsuba's medium below the skin, exact in colour where the camera looks."""
    extinction = 1.0 / mean_free_path_mm
    low, high = _grid_box(person, camera)
    grid = single_scattering_albedo(colour_grid(person, low, high, VOXELS)).astype(np.float32)
    to_world = mi.ScalarTransform4f().translate([float(c) for c in low])
    return mi.load_dict(
        {
            "type": "homogeneous",
            "albedo": {
                "type": "gridvolume",
                "grid": mi.VolumeGrid(np.ascontiguousarray(grid)),
                "raw": True,
                "to_world": to_world.scale([float(c) for c in high - low]),
            },
            "sigma_t": rgb(extinction / extinction.max()),  # textures hold at most 1
            "scale": float(extinction.max()),
            "phase": {"type": "isotropic"},
        }
    )


def _grid_box(person: Person, camera: Camera) -> tuple[Doubles, Doubles]:
    """Return two corners of the part of the head in the picture; beyond it colours are constant."""
    reach = max(_GRID_MARGIN * camera.frame_mm, _MIN_HALF_SIDE_MM)
    skin = person.mesh.positions[np.unique(_skin_triangles(person))]
    middle = np.array(camera.target, np.float64)
    low = np.maximum(skin.min(axis=0) - _COLOUR_DEPTH_MM, middle - reach)
    high = np.minimum(skin.max(axis=0) + _COLOUR_DEPTH_MM, middle + reach)
    return low, np.maximum(high, low + 1.0)


def _skin_triangles(person: Person) -> NDArray[np.int32]:
    """Return (f, 3) triangles of skin."""
    mesh = person.mesh
    kinds = np.array([one.kind == "skin" for one in mesh.materials])
    return np.asarray(mesh.triangles[kinds[mesh.material]])


def colour_grid(person: Person, low: Doubles, high: Doubles, voxels: int) -> Doubles:
    """Return (z, y, x, 3) colours of the nearest skin in even cells of a box, deeper inside the mean of all.

    low, high : (3,) corners of the box [mm]
    """
    from scipy.ndimage import binary_dilation
    from scipy.spatial import cKDTree

    side = float((high - low).max()) / voxels
    count = np.maximum(np.ceil((high - low) / side).astype(int), 1)
    places, colour = _skin_samples(person, low, high, side)
    grid = np.tile(colour.mean(axis=0) if len(colour) else np.full(3, 0.5), (*count[::-1], 1))
    if not len(places):
        return grid
    cell = np.clip(((places - low) / (high - low) * count).astype(int), 0, count - 1)
    near = np.zeros(count[::-1], bool)
    near[cell[:, 2], cell[:, 1], cell[:, 0]] = True
    near = binary_dilation(near, iterations=max(2, int(np.ceil(_COLOUR_DEPTH_MM / side))))
    wanted = np.argwhere(near)
    middles = low + (wanted[:, ::-1] + 0.5) / count * (high - low)
    _, nearest = cKDTree(places).query(middles, k=min(4, len(places)))
    grid[near] = colour[nearest.reshape(len(middles), -1)].mean(axis=1)
    return grid


def _skin_samples(person: Person, low: Doubles, high: Doubles, side: float) -> tuple[Doubles, Doubles]:
    """Return places on the skin in a box (n, 3) and their colours (n, 3), the same each time."""
    mesh, triangles = person.mesh, _skin_triangles(person)
    corners = mesh.positions[triangles].astype(np.float64)
    inside = ((corners.max(axis=1) >= low - _COLOUR_DEPTH_MM) & (corners.min(axis=1) <= high + _COLOUR_DEPTH_MM)).all(axis=1)
    triangles, corners = triangles[inside], corners[inside]
    rng = np.random.default_rng(0)
    many = rng.poisson(_SAMPLES_PER_VOXEL * triangle_areas(corners) / side**2) + 1
    of = np.repeat(np.arange(len(triangles)), many)
    weights = rng.dirichlet((1.0, 1.0, 1.0), len(of))
    places = np.einsum("nk,nkc->nc", weights, corners[of])
    uv = np.einsum("nk,nkc->nc", weights, mesh.uv[triangles[of]].astype(np.float64))
    picture = person.paint.colour
    rows, columns = picture.shape[:2]
    x, y = np.clip((uv * [columns, rows]).astype(int), 0, [columns - 1, rows - 1]).T
    return places, picture[y, x].astype(np.float64)
