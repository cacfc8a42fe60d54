"""Scattering medium below a person's painted skin: mean free path and a grid of albedos."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.half_space import diffuse_albedo
from dermis.apps.truths.person.person import Person
from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject, mitsuba_rgb
from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.mesh.geometry import triangle_areas
from dermis.optics.media import SKIN_ETA
from dermis.scene.camera import Camera

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]

COAT_TRANSMITTANCE = 0.98
"""Fraction of light that the coat transmits, see `coat_bsdf`; the medium compensates for it."""
COAT_INDEX = SKIN_ETA
GRID_VOXELS = 96
"""Number of cells along the longest side of the albedo grid."""
_GRID_MARGIN, _MIN_HALF_SIDE_MM = 0.75, 25.0
"""Half the side of the albedo grid, relative to the height that the picture shows, and its lower limit."""
_COLOUR_DEPTH_MM = 3.0  # depth to which the medium has the colour of the surface
_SAMPLES_PER_VOXEL = 3.0  # samples per area of one voxel face
_MAX_COLOUR = 0.97
_MIN_ROOT = 0.01  # smallest tabulated square root of 1 - albedo
_PHOTONS = 40_000


@cache
def _albedo_table() -> tuple[Doubles, Doubles]:
    """Return tabulated diffuse albedos of half-spaces, and sqrt(1 - single-scattering albedo) of each."""
    absorption_root = np.linspace(1.0, _MIN_ROOT, 32)
    return np.array([diffuse_albedo(float(1.0 - one**2)) for one in absorption_root]), absorption_root


def single_scattering_albedo(colour: ArrayLike) -> Doubles:
    """Return the single-scattering albedo of half-spaces that have a given diffuse albedo under the coat [-].

    colour : diffuse albedo of the medium as seen through the coat, which transmits `COAT_TRANSMITTANCE`
    """
    diffuse_albedos, absorption_root = _albedo_table()
    clipped = np.clip(np.asarray(colour, np.float64) / COAT_TRANSMITTANCE, 0.0, _MAX_COLOUR)
    return np.asarray(1.0 - np.interp(clipped, diffuse_albedos, absorption_root) ** 2)


def mean_free_paths(colour: ArrayLike, distance_mm: ArrayLike) -> Doubles:
    """Return mean free paths (3,) of media in which light leaves at given mean distances from entry [mm].

    The mean distances in media with a mean free path of 1 mm are found by Monte Carlo at normal incidence.

    colour : (3,) diffuse albedo of the medium as seen through the coat
    distance_mm : (3,) mean lateral offset of exit points [mm]
    """
    pairs = zip(single_scattering_albedo(colour), np.asarray(distance_mm, np.float64), strict=True)
    return np.array([distance / _mean_offset(round(float(albedo), 4)) for albedo, distance in pairs])


@cache
def _mean_offset(albedo: float) -> float:
    """Return the mean lateral distance between entry and exit in a half-space, in mean free paths.

    albedo : single-scattering albedo [-]
    """
    edges = np.concatenate([[0.0], np.geomspace(1e-3, 400.0, 120)])
    layer = ScatteringLayer(1.0 - albedo, albedo, eta=1.0)
    energy = trace_slab([layer], _PHOTONS, edges_mm=edges).reflectance * np.pi * np.diff(edges**2)
    return float((energy * 0.5 * (edges[1:] + edges[:-1])).sum() / energy.sum())


def skin_medium(mi: Mitsuba, person: Person, camera: Camera, mean_free_path_mm: Doubles) -> MitsubaObject:
    """Return Mitsuba's medium below the skin, with a grid of albedos around the camera's target."""
    extinction = 1.0 / mean_free_path_mm
    low, high = _grid_box(person, camera)
    grid = single_scattering_albedo(colour_grid(person, low, high, GRID_VOXELS)).astype(np.float32)
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
            "sigma_t": mitsuba_rgb(extinction / extinction.max()),  # textures are limited to 1
            "scale": float(extinction.max()),
            "phase": {"type": "isotropic"},
        }
    )


def _grid_box(person: Person, camera: Camera) -> tuple[Doubles, Doubles]:
    """Return the low and high corner (3,) of a box around the visible part of the head [mm].

    Albedos vary inside this box, and are constant outside.
    """
    half_side = max(_GRID_MARGIN * camera.frame_mm, _MIN_HALF_SIDE_MM)
    skin = person.mesh.positions[np.unique(_skin_triangles(person))]
    middle = np.array(camera.target, np.float64)
    low = np.maximum(skin.min(axis=0) - _COLOUR_DEPTH_MM, middle - half_side)
    high = np.minimum(skin.max(axis=0) + _COLOUR_DEPTH_MM, middle + half_side)
    return low, np.maximum(high, low + 1.0)


def _skin_triangles(person: Person) -> NDArray[np.int32]:
    """Return the vertex indices (f, 3) of the triangles of skin."""
    mesh = person.mesh
    kinds = np.array([one.kind == "skin" for one in mesh.materials])
    return np.asarray(mesh.triangles[kinds[mesh.material]])


def colour_grid(person: Person, low: Doubles, high: Doubles, voxels: int) -> Doubles:
    """Return the colour (z, y, x, 3) of each cell of a box, averaged over the nearest points of the skin.

    Cells farther from the skin than the colour reaches have the mean colour.

    low, high : (3,) corners of the box [mm]
    voxels : number of cells along the longest side
    """
    from scipy.ndimage import binary_dilation
    from scipy.spatial import cKDTree

    cell_mm = float((high - low).max()) / voxels
    cell_count = np.maximum(np.ceil((high - low) / cell_mm).astype(int), 1)
    positions, colour = _skin_samples(person, low, high, cell_mm)
    grid = np.tile(colour.mean(axis=0) if len(colour) else np.full(3, 0.5), (*cell_count[::-1], 1))
    if not len(positions):
        return grid
    cell = np.clip(((positions - low) / (high - low) * cell_count).astype(int), 0, cell_count - 1)
    is_near = np.zeros(cell_count[::-1], bool)
    is_near[cell[:, 2], cell[:, 1], cell[:, 0]] = True
    is_near = binary_dilation(is_near, iterations=max(2, int(np.ceil(_COLOUR_DEPTH_MM / cell_mm))))
    near_cells = np.argwhere(is_near)
    cell_centres = low + (near_cells[:, ::-1] + 0.5) / cell_count * (high - low)
    _, nearest = cKDTree(positions).query(cell_centres, k=min(4, len(positions)))
    grid[is_near] = colour[nearest.reshape(len(cell_centres), -1)].mean(axis=1)
    return grid


def _skin_samples(person: Person, low: Doubles, high: Doubles, cell_mm: float) -> tuple[Doubles, Doubles]:
    """Return random positions (n, 3) on the skin in a box, and the skin's colours (n, 3) there.

    The random seed is fixed.

    low, high : (3,) corners of the box [mm]
    cell_mm : size of a cell, which determines the number of samples [mm]
    """
    mesh, triangles = person.mesh, _skin_triangles(person)
    corners = mesh.positions[triangles].astype(np.float64)
    inside = (
        (corners.max(axis=1) >= low - _COLOUR_DEPTH_MM) & (corners.min(axis=1) <= high + _COLOUR_DEPTH_MM)
    ).all(axis=1)
    triangles, corners = triangles[inside], corners[inside]
    rng = np.random.default_rng(0)
    sample_counts = rng.poisson(_SAMPLES_PER_VOXEL * triangle_areas(corners) / cell_mm**2) + 1
    triangle_of = np.repeat(np.arange(len(triangles)), sample_counts)
    weights = rng.dirichlet((1.0, 1.0, 1.0), len(triangle_of))
    positions = np.einsum("nk,nkc->nc", weights, corners[triangle_of])
    uv = np.einsum("nk,nkc->nc", weights, mesh.uv[triangles[triangle_of]].astype(np.float64))
    picture = person.textures.colour
    rows, columns = picture.shape[:2]
    x, y = np.clip((uv * [columns, rows]).astype(int), 0, [columns - 1, rows - 1]).T
    return positions, picture[y, x].astype(np.float64)
