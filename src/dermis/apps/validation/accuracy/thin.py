"""Errors of light transmitted through thin bodies: slabs, wedges and ears."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import dermis
from dermis.apps.truths.irradiance_samples import MeshPoints, sample_irradiance
from dermis.apps.truths.radial_table import GaussianSum as ReferenceProfile
from dermis.apps.truths.surface_integral import integrate_exitance
from dermis.apps.validation.pages import print_tables
from dermis.gpu import download
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import wedge
from dermis.optics.diffusion.models import gaussian_transmittance
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene import Scene, Settings, Skin
from dermis.scene.lights import DirectionalLight

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
PointFilter = Callable[[Array, Array], Mask]  # mask of points from their positions and normals
MATTE_SKIN = Skin(albedo="profile", rho_s=0.0)
GPU_GEMS_3_PROFILE = load_profile("gpu-gems-3")
BLURRED_PROFILE = GaussianSum(
    "blurred levels", GPU_GEMS_3_PROFILE.variance_mm2[1:], GPU_GEMS_3_PROFILE.weight[1:]
)
THICKNESSES_MM = (0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
WEDGE_DEGREES = (5.0, 10.0, 20.0, 30.0, 45.0)
ATLAS_SIDE = 1024
EAR_DISTANCE_FROM_MIDPLANE_MM = 66.0  # distance from the scan's middle beyond which a point is on an ear


def print_thin_body_errors(adapter: str = "auto") -> None:
    """Print tables with errors of light transmitted through slabs, wedges and ears."""
    print_tables(thin_body_error_tables(adapter))


def scattered_light(
    renderer: dermis.Renderer,
    mesh: Mesh,
    light_direction: Array,
    skin: Skin,
    atlas_side: int,
    **setting_values: str,
) -> tuple[Array, Array, Array]:
    """Return positions, normals and scattered light (n, 3) of the atlas texels of a mesh in parallel light.

    light_direction : (3,) direction of the light, which casts no shadows
    atlas_side : side of the atlas [texel]
    setting_values : further settings of the frame
    """
    light = DirectionalLight(direction=tuple(light_direction), irradiance=(1.0, 1.0, 1.0), shadows=False)
    scene = Scene(Head("thin", mesh, Maps()), lights=[light], skin=skin)
    settings = Settings.model_validate(
        {"size": (16, 16), "atlas": atlas_side, "samples": 1, **setting_values}
    )
    renderer.draw(scene, settings)
    inputs = renderer.prepare(scene, settings)
    texels = download(renderer.device, inputs.layouts[0].atlas.resources["atlas"])
    has_surface = texels[..., 0] > 0
    w = np.stack([texels[has_surface][:, 1] & 0xFFFF, texels[has_surface][:, 1] >> 16], axis=-1) / 65535.0
    w = np.column_stack([1 - w.sum(axis=1), w])
    corners = mesh.triangles[texels[has_surface][:, 0].astype(int) - 1]
    points, normals = (np.einsum("nk,nkc->nc", w, a[corners]) for a in (mesh.positions, mesh.normals))
    light_map = download(renderer.device, inputs.resources.scattered)
    return points, normals, light_map[has_surface][:, :3].astype(float)


def integrated_light(mesh: Mesh, light_direction: Array, points: Array, spacing_mm: float) -> Array:
    """Return the scattered light (n, 3) at points, by integrating irradiance times profile over the surface.

    The profile is a function of Euclidean distance.

    light_direction : (3,) direction of the light
    points : (n, 3) positions [mm]
    spacing_mm : largest distance between neighbouring samples of the irradiance
    """

    def irradiance_at(samples: MeshPoints) -> Array:
        normals = samples.interpolate(mesh, mesh.normals)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        return np.repeat(np.maximum(normals @ -light_direction, 0.0)[:, None], 3, axis=1)

    profile = ReferenceProfile(BLURRED_PROFILE.weight, BLURRED_PROFILE.variance_mm2)
    samples = sample_irradiance(mesh, irradiance_at, spacing_mm)
    return integrate_exitance(points, samples, profile, 0.002)


def slab_rows(renderer: dermis.Renderer) -> str:
    """Return Markdown rows with the transmittance of slabs: rendered, and computed from a diffusion profile.

    The profile is `BLURRED_PROFILE`. The rendered transmittance is measured far from the rim of the slabs.
    """
    rows = []
    for thickness in THICKNESSES_MM:
        beam = np.array([0.0, 0.0, 1.0])
        slab = wedge(60.0, thickness, thickness)
        points, normals, light = scattered_light(renderer, slab, beam, MATTE_SKIN, 256, transmission="thin")
        inner = (normals[:, 2] > 0.9) & (np.abs(points[:, :2]).max(axis=1) < 12.0)
        rendered, exact = light[inner].mean(axis=0), gaussian_transmittance(BLURRED_PROFILE, thickness)
        cells = (" ".join(f"{value:.4f}" for value in one) for one in (rendered, exact))
        rows.append(f"| {thickness:g} mm | {' | '.join(cells)} |")
    return "\n".join(rows)


def light_across_air(mesh: Mesh, light_direction: Array, points: Array, normals: Array) -> Array:
    """Return the red light (n,) that the surface integral wrongly carries through air to the points.

    The integral depends on straight distances only. It therefore also includes light between parts of the
    surface that are separated by air, not by skin.

    light_direction : (3,) direction of the light
    points : (n, 3) positions
    normals : (n, 3) surface normals
    """

    def irradiance_at(points: MeshPoints) -> Array:
        cosine = points.interpolate(mesh, mesh.normals) @ -light_direction
        return np.repeat(np.maximum(cosine, 0.0)[:, None], 3, axis=1)

    samples = sample_irradiance(mesh, irradiance_at, 0.5)
    corners = samples.positions[samples.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(across, axis=1)
    flux = area * samples.irradiance[samples.triangles][..., 0].mean(axis=1)
    lit = np.flatnonzero(flux)
    sources, outward = corners[lit].mean(axis=1), across[lit] / (2.0 * area[lit, None])
    neighbours = cKDTree(sources).query_ball_point(points, 4.0 * np.sqrt(BLURRED_PROFILE.variance_mm2[-1]))
    total = np.zeros(len(points))
    for i, j in enumerate(neighbours):
        towards = sources[j] - points[i]
        facing = (towards * outward[j]).sum(axis=1) < towards @ normals[i]
        turned_away = outward[j] @ normals[i] < 0.5
        square = (towards**2).sum(axis=1)[facing & turned_away, None]
        profile = np.exp(-0.5 * square / BLURRED_PROFILE.variance_mm2) / (
            2.0 * np.pi * BLURRED_PROFILE.variance_mm2
        )
        total[i] = flux[lit][j][facing & turned_away] @ profile @ BLURRED_PROFILE.weight[:, 0]
    return total


def comparison_cells(
    renderer: dermis.Renderer,
    mesh: Mesh,
    light_direction: Array,
    point_filter: PointFilter,
    atlas_side: int,
    spacing_mm: float,
    *,
    adds_air_corrected_cell: bool,
) -> str:
    """Return table cells with the energy ratio and the relative RMSE of rendered light, for two settings.

    The first two cells are for the setting `transmission` "none", the next two for "thin". The reference is
    the surface integral.

    point_filter : function that returns the mask of the points to compare, given positions and normals
    spacing_mm : largest distance between neighbouring samples of the irradiance
    adds_air_corrected_cell : whether to add a fifth cell: the energy ratio for "thin" if `light_across_air`
        is subtracted from the reference
    """
    cells = []
    for transmission in ("none", "thin"):
        lit = scattered_light(
            renderer, mesh, light_direction, MATTE_SKIN, atlas_side, transmission=transmission
        )
        points, normals, light = lit
        selected = np.flatnonzero(point_filter(points, normals))
        selected = np.random.default_rng(5).permutation(selected)[:3000]
        exact = integrated_light(mesh, light_direction, points[selected], spacing_mm)[:, 0]
        red = light[selected, 0]
        error = red - exact
        cells += [f"{red.sum() / exact.sum():.3f}", f"{np.sqrt((error**2).mean() / (exact**2).mean()):.1%}"]
    if adds_air_corrected_cell:
        inside = exact - light_across_air(mesh, light_direction, points[selected], normals[selected])
        cells.append(f"{red.sum() / inside.sum():.3f}")
    return " | ".join(cells)


def wedge_rows(renderer: dermis.Renderer) -> str:
    """Return Markdown rows with errors of red light on the unlit side of wedges, near their edge."""
    rows = []
    for angle in WEDGE_DEGREES:
        mesh = wedge(60.0, 0.01, 120.0 * float(np.tan(np.radians(angle / 2))), cells_per_side=16)

        def unlit_points(points: Array, normals: Array, half_angle: float = angle / 2) -> Mask:
            facing = normals @ [-np.sin(np.radians(half_angle)), 0.0, np.cos(np.radians(half_angle))] > 0.99
            return np.asarray(facing & (points[:, 0] < -15.0) & (np.abs(points[:, 1]) < 15.0))

        cells = comparison_cells(
            renderer, mesh, np.array([0.0, 0.0, 1.0]), unlit_points, 512, 0.7, adds_air_corrected_cell=False
        )
        rows.append(f"| {angle:g}° | {cells} |")
    return "\n".join(rows)


def ear_rows(renderer: dermis.Renderer) -> str:
    """Return Markdown rows with errors of red light on the unlit side of ears.

    The ears are lit from behind or from the front.
    """
    rows = []
    for name in ("lee_perry_smith", "human"):
        head = dermis.load_head(name, subdivide=0)
        mesh, centre = head.mesh, np.array(head.centre_mm)
        for side, z in (("behind", 1.0), ("the front", -1.0)):
            beam = np.array([0.0, 0.0, z])

            def unlit_points(points: Array, normals: Array, z: float = z, centre: Array = centre) -> Mask:
                local = points - centre
                ear = (np.abs(local[:, 0]) > EAR_DISTANCE_FROM_MIDPLANE_MM) & (np.abs(local[:, 1]) < 45.0)
                return np.asarray(ear & (z * normals[:, 2] > 0.3))

            cells = comparison_cells(
                renderer, mesh, beam, unlit_points, ATLAS_SIDE, 1.5, adds_air_corrected_cell=True
            )
            rows.append(f"| {name} | {side} | {cells} |")
    return "\n".join(rows)


def thin_body_error_tables(adapter: str = "auto") -> dict[str, str]:
    """Return Markdown rows with errors of light transmitted through thin bodies: slabs, wedges and ears.

    They are keyed by the placeholders of docs/templates/accuracy.md that they replace.
    """
    renderer = dermis.Renderer(adapter)
    rows = {"thin_slabs": slab_rows, "thin_wedges": wedge_rows, "thin_ears": ear_rows}
    return {name: make(renderer) for name, make in rows.items()}
