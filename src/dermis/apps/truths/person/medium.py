"""Layers of a person's skin: their coefficients, and a grid of albedos in the deepest layer."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.half_space import directional_albedo
from dermis.apps.truths.mitsuba_scene import homogeneous_medium
from dermis.apps.truths.person.person import Person
from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject
from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.base.errors import refuse
from dermis.mesh.geometry import triangle_areas
from dermis.optics.media import SKIN_ETA, Layer, Medium
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.pigments.skin import spectral_medium
from dermis.optics.pigments.spectra import rgb_weights
from dermis.scene.camera import Camera

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]

COAT_TRANSMITTANCE = 0.98
"""Fraction of light that the coat transmits, see `coat_bsdf`; the medium compensates for it."""
COAT_IOR = SKIN_ETA
ALBEDO_GRID_SIDE_VOXELS = 96
"""Number of cells along the longest side of the albedo grid."""
_HALF_SIDE_PER_FRAME_HEIGHT, _MIN_HALF_SIDE_MM = 0.75, 25.0
"""Half the side of the albedo grid, divided by the height of the visible area; and the smallest half side."""
_COLOURED_DEPTH_MM = 3.0  # depth to which the medium has the colour of the surface
_SAMPLES_PER_VOXEL = 3.0  # samples per area of one voxel face
_MAX_SKIN_REFLECTANCE = 0.97
_MIN_SQRT_CO_ALBEDO = 0.02  # smallest tabulated square root of 1 - albedo
_DISTANCE_PHOTON_COUNT, _TABLE_PHOTON_COUNT = 40_000, 40_000
_HALF_SPACE_TABLE_ALBEDO_COUNT = 48
_STACK_TABLE_ALBEDO_COUNT = 20
"""Number of albedos of the last layer for which the reflectance of several layers is tabulated."""


def uniform_skin(colour: ArrayLike, exit_distance_mm: ArrayLike, eta: float) -> Medium:
    """Return a homogeneous skin with a given colour and mean distance between entry and exit of light.

    colour : (3,) reflectance of light at normal incidence [-]
    exit_distance_mm : (3,) mean distance along the surface from the point where light enters, at normal
        incidence, to the point where it leaves [mm]
    eta : index of refraction, 1 or `SKIN_ETA` [-]
    """
    albedo = _half_space_albedo(colour, eta)
    offsets = [_mean_exit_distance(round(float(one), 4), eta) for one in albedo]
    extinction = np.array(offsets) / np.asarray(exit_distance_mm, np.float64)
    return Medium("uniform", (Layer((1.0 - albedo) * extinction, albedo * extinction, name="skin"),), eta)


def pigmented_skin(parameters: SkinParameters, colour: ArrayLike, eta: float) -> Medium:
    """Return a skin of epidermis and dermis with a given colour, in three channels.

    For each channel, the spectra of both layers are averaged over the wavelengths, weighted by the positive
    part of the channel's sensitivity. The albedo of the dermis is then replaced by the albedo for which the
    whole skin has the given colour.

    parameters : pigments and thickness of the epidermis
    colour : (3,) reflectance of light at normal incidence [-]
    eta : index of refraction, 1 or `SKIN_ETA` [-]

    Source: [DonnerJensen2006].
    """
    sensitivity = np.maximum(rgb_weights(), 0.0)
    sensitivity /= sensitivity.sum(axis=1, keepdims=True)
    layers = tuple(
        replace(one, sigma_a=sensitivity @ one.sigma_a, sigma_s_prime=sensitivity @ one.sigma_s_prime)
        for one in spectral_medium("dj2006", parameters).layers
    )
    medium = Medium("pigmented", layers, eta)
    return with_deepest_albedo(medium, deepest_albedo(medium, colour))


def with_deepest_albedo(medium: Medium, albedo: ArrayLike) -> Medium:
    """Return the medium with a new single-scattering albedo (3,), but equal extinction, in its last layer."""
    *above, last = medium.layers
    extinction, albedo = last.sigma_t_prime, np.asarray(albedo)
    return replace(
        medium,
        layers=(
            *above,
            replace(last, sigma_a=(1.0 - albedo) * extinction, sigma_s_prime=albedo * extinction),
        ),
    )


def deepest_albedo(medium: Medium, colour: ArrayLike) -> Doubles:
    """Return single-scattering albedos of a medium's last layer for which the medium has given colours [-].

    If the layers above rule out a colour, the albedo for the nearest possible colour is returned.

    medium : layers in three channels; the albedo of the last layer is ignored
    colour : (..., 3) reflectance of light at normal incidence, relative to the light that enters [-]
    """
    wanted = np.asarray(colour, np.float64)
    if len(medium.layers) == 1:
        return _half_space_albedo(wanted, medium.eta)
    layers = tuple(
        tuple(
            (*map(float, pair), one.thickness_mm) for pair in zip(one.sigma_a, one.sigma_s_prime, strict=True)
        )
        for one in medium.layers
    )
    roots = np.linspace(1.0, _MIN_SQRT_CO_ALBEDO, _STACK_TABLE_ALBEDO_COUNT)
    found = [
        np.interp(wanted[..., c], _reflectance_table(tuple(one[c] for one in layers), medium.eta), roots)
        for c in range(3)
    ]
    return np.asarray(1.0 - np.stack(found, axis=-1) ** 2)


@cache
def _reflectance_table(layers: tuple[tuple[float, float, float], ...], eta: float) -> Doubles:
    """Return the Monte Carlo reflectance of a stack of layers, for a series of albedos of its last layer [-].

    layers : absorption coefficient [1/mm], scattering coefficient [1/mm] and thickness [mm] of each layer; of
        the last layer, only the sum of the coefficients is used
    eta : index of refraction of all layers [-]
    """
    above = [ScatteringLayer(a, s, thickness, eta=eta) for a, s, thickness in layers[:-1]]
    extinction = layers[-1][0] + layers[-1][1]
    totals = []
    for root in np.linspace(1.0, _MIN_SQRT_CO_ALBEDO, _STACK_TABLE_ALBEDO_COUNT):
        last = ScatteringLayer(root**2 * extinction, (1.0 - root**2) * extinction, eta=eta)
        totals.append(trace_slab([*above, last], _TABLE_PHOTON_COUNT).relative_to_entering.total_reflectance)
    return np.maximum.accumulate(totals)


def _half_space_albedo(colour: ArrayLike, eta: float) -> Doubles:
    """Return single-scattering albedos of half-spaces that have given colours [-]."""
    totals, roots = _half_space_reflectance_table(eta)
    wanted = np.clip(np.asarray(colour, np.float64), 0.0, _MAX_SKIN_REFLECTANCE)
    return np.asarray(1.0 - np.interp(wanted, totals, roots) ** 2)


@cache
def _half_space_reflectance_table(eta: float) -> tuple[Doubles, Doubles]:
    """Return reflectances of half-spaces at normal incidence, and sqrt(1 - single-scattering albedo) of each.

    The reflectances are exact for an index of refraction of 1, and from Monte Carlo for `SKIN_ETA`.
    """
    roots = np.linspace(1.0, _MIN_SQRT_CO_ALBEDO, _HALF_SPACE_TABLE_ALBEDO_COUNT)
    if eta == 1.0:
        return np.array([float(directional_albedo(1.0, float(1.0 - root**2))) for root in roots]), roots
    if eta != SKIN_ETA:
        refuse("skin", f"an index of refraction of 1 or {SKIN_ETA}", f"got {eta:g}", "Choose one of them")
    layers = (ScatteringLayer(root**2, 1.0 - root**2, eta=eta) for root in roots.tolist())
    runs = (trace_slab([layer], _TABLE_PHOTON_COUNT).relative_to_entering for layer in layers)
    return np.maximum.accumulate([run.total_reflectance for run in runs]), roots


@cache
def _mean_exit_distance(albedo: float, eta: float) -> float:
    """Return the mean lateral distance between entry and exit of light in a half-space, in mean free paths.

    albedo : single-scattering albedo [-]
    eta : index of refraction [-]
    """
    edges = np.concatenate([[0.0], np.geomspace(1e-3, 400.0, 120)])
    layer = ScatteringLayer(1.0 - albedo, albedo, eta=eta)
    energy = (
        trace_slab([layer], _DISTANCE_PHOTON_COUNT, edges_mm=edges).reflectance * np.pi * np.diff(edges**2)
    )
    return float((energy * 0.5 * (edges[1:] + edges[:-1])).sum() / energy.sum())


def skin_media(mi: Mitsuba, person: Person, camera: Camera, medium: Medium) -> list[MitsubaObject]:
    """Return Mitsuba's media of the layers of a skin, topmost first.

    The albedo of the deepest layer varies in space, so that the skin has the colours of its colour map. It is
    given by a voxel grid in a box around the part of the skin that the camera shows.

    medium : layers of a skin that has the mean colour of the colour map
    """
    *above, last = medium.layers
    low, high = _voxel_box(person, camera)
    transmittance = COAT_TRANSMITTANCE if medium.eta == 1.0 else 1.0
    colours = colour_grid(person, low, high, ALBEDO_GRID_SIDE_VOXELS) / transmittance
    grid = deepest_albedo(medium, colours).astype(np.float32)
    to_world = mi.ScalarTransform4f().translate([float(c) for c in low])
    albedo = {
        "type": "gridvolume",
        "grid": mi.VolumeGrid(np.ascontiguousarray(grid)),
        "raw": True,
        "to_world": to_world.scale([float(c) for c in high - low]),
    }
    deepest = homogeneous_medium(last) | {"albedo": albedo}
    return [mi.load_dict(one) for one in (*map(homogeneous_medium, above), deepest)]


def _voxel_box(person: Person, camera: Camera) -> tuple[Doubles, Doubles]:
    """Return the low and high corner (3,) of the box of the albedo grid, around the visible skin [mm]."""
    half_side = max(_HALF_SIDE_PER_FRAME_HEIGHT * camera.frame_mm, _MIN_HALF_SIDE_MM)
    skin = person.mesh.positions[np.unique(_skin_triangles(person))]
    middle = np.array(camera.target, np.float64)
    low = np.maximum(skin.min(axis=0) - _COLOURED_DEPTH_MM, middle - half_side)
    high = np.minimum(skin.max(axis=0) + _COLOURED_DEPTH_MM, middle + half_side)
    return low, np.maximum(high, low + 1.0)


def _skin_triangles(person: Person) -> NDArray[np.int32]:
    """Return the vertex indices (f, 3) of the skin's triangles."""
    mesh = person.mesh
    kinds = np.array([one.kind == "skin" for one in mesh.materials])
    return np.asarray(mesh.triangles[kinds[mesh.material]])


def colour_grid(person: Person, low_corner: Doubles, high_corner: Doubles, voxels_per_side: int) -> Doubles:
    """Return for each voxel of a box the mean colour (z, y, x, 3) of the skin points nearest to it.

    Voxels more than about 3 mm from the skin have the mean colour of all points.

    low_corner, high_corner : (3,) corners of the box [mm]
    voxels_per_side : number of voxels along the longest side
    """
    from scipy.ndimage import binary_dilation
    from scipy.spatial import cKDTree

    cell_mm = float((high_corner - low_corner).max()) / voxels_per_side
    cell_count = np.maximum(np.ceil((high_corner - low_corner) / cell_mm).astype(int), 1)
    positions, colour = _skin_samples(person, low_corner, high_corner, cell_mm)
    grid = np.tile(colour.mean(axis=0) if len(colour) else np.full(3, 0.5), (*cell_count[::-1], 1))
    if not len(positions):
        return grid
    cell = np.clip(
        ((positions - low_corner) / (high_corner - low_corner) * cell_count).astype(int), 0, cell_count - 1
    )
    is_near = np.zeros(cell_count[::-1], bool)
    is_near[cell[:, 2], cell[:, 1], cell[:, 0]] = True
    is_near = binary_dilation(is_near, iterations=max(2, int(np.ceil(_COLOURED_DEPTH_MM / cell_mm))))
    near_cells = np.argwhere(is_near)
    cell_centres = low_corner + (near_cells[:, ::-1] + 0.5) / cell_count * (high_corner - low_corner)
    _, nearest = cKDTree(positions).query(cell_centres, k=min(4, len(positions)))
    grid[is_near] = colour[nearest.reshape(len(cell_centres), -1)].mean(axis=1)
    return grid


def _skin_samples(
    person: Person, low_corner: Doubles, high_corner: Doubles, cell_mm: float
) -> tuple[Doubles, Doubles]:
    """Return random positions (n, 3) on the skin in a box, and the skin's colours (n, 3) at these positions.

    The random seed is fixed.

    low_corner, high_corner : (3,) corners of the box [mm]
    cell_mm : side length of a voxel; smaller voxels need more positions [mm]
    """
    mesh, triangles = person.mesh, _skin_triangles(person)
    corners = mesh.positions[triangles].astype(np.float64)
    inside = (
        (corners.max(axis=1) >= low_corner - _COLOURED_DEPTH_MM)
        & (corners.min(axis=1) <= high_corner + _COLOURED_DEPTH_MM)
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
