"""Errors of light through thin parts: slabs, wedges and ears."""

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
PointFilter = Callable[[Array, Array], NDArray[np.bool_]]  # of places by their positions and normals
MATTE = Skin(albedo="profile", rho_s=0.0)
PROFILE = load_profile("gpu-gems-3")
BLURRED = GaussianSum("blurred levels", PROFILE.variance_mm2[1:], PROFILE.weight[1:])
THICKNESSES_MM = (0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
ANGLES = (5.0, 10.0, 20.0, 30.0, 45.0)
ATLAS = 1024
EAR_DISTANCE_MM = 66.0  # the scan's ears lie farther from its middle


def thin(adapter: str = "auto") -> None:
    """Print the tables of light through slabs, wedges and ears."""
    print_tables(tables(adapter))


def scattered_light(
    renderer: dermis.Renderer, mesh: Mesh, way: Array, skin: Skin, atlas: int, **chosen: str
) -> tuple[Array, Array, Array]:
    """Return (n, 3) places, normals and light of a mesh's texels, lit from one side without shadows.

    chosen : further settings of the frame
    """
    light = DirectionalLight(direction=tuple(way), irradiance=(1.0, 1.0, 1.0), shadows=False)
    scene = Scene(Head("thin", mesh, Maps()), lights=[light], skin=skin)
    settings = Settings.model_validate({"size": (16, 16), "atlas": atlas, "samples": 1, **chosen})
    renderer.draw(scene, settings)
    inputs = renderer.prepare(scene, settings)
    texels = download(renderer.device, inputs.layouts[0].atlas.resources["atlas"])
    own = texels[..., 0] > 0
    w = np.stack([texels[own][:, 1] & 0xFFFF, texels[own][:, 1] >> 16], axis=-1) / 65535.0
    w = np.column_stack([1 - w.sum(axis=1), w])
    corners = mesh.triangles[texels[own][:, 0].astype(int) - 1]
    places, normals = (np.einsum("nk,nkc->nc", w, a[corners]) for a in (mesh.positions, mesh.normals))
    return places, normals, download(renderer.device, inputs.resources.scattered)[own][:, :3].astype(float)


def integrated_light(mesh: Mesh, way: Array, places: Array, spacing: float) -> Array:
    """Return light at places by the profile of straight-line distance, summed over the surface."""

    def light(at: MeshPoints) -> Array:
        normals = at.interpolate(mesh, mesh.normals)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        return np.repeat(np.maximum(normals @ -way, 0.0)[:, None], 3, axis=1)

    profile = ReferenceProfile(BLURRED.weight, BLURRED.variance_mm2)
    samples = sample_irradiance(mesh, light, spacing)
    return integrate_exitance(places, samples, profile, 0.002)


def slab_rows(renderer: dermis.Renderer) -> str:
    """Return light through slabs far from their rim, as the frame has it and as the profile says."""
    rows = []
    for thickness in THICKNESSES_MM:
        way = np.array([0.0, 0.0, 1.0])
        places, normals, light = scattered_light(
            renderer, wedge(60.0, thickness, thickness), way, MATTE, 256, transmission="thin"
        )
        inner = (normals[:, 2] > 0.9) & (np.abs(places[:, :2]).max(axis=1) < 12.0)
        made, exact = light[inner].mean(axis=0), gaussian_transmittance(BLURRED, thickness)
        shown = (" ".join(f"{value:.4f}" for value in light) for light in (made, exact))
        rows.append(f"| {thickness:g} mm | {' | '.join(shown)} |")
    return "\n".join(rows)


def light_across_air(mesh: Mesh, way: Array, places: Array, normals: Array) -> Array:
    """Return the red light of the sum whose straight path crosses air."""

    def light(at: MeshPoints) -> Array:
        turned = at.interpolate(mesh, mesh.normals)
        return np.repeat(np.maximum(turned @ -way, 0.0)[:, None], 3, axis=1)

    samples = sample_irradiance(mesh, light, 0.5)
    corners = samples.positions[samples.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(across, axis=1)
    flux = area * samples.irradiance[samples.triangles][..., 0].mean(axis=1)
    lit = np.flatnonzero(flux)
    at, out = corners[lit].mean(axis=1), across[lit] / (2.0 * area[lit, None])
    near = cKDTree(at).query_ball_point(places, 4.0 * np.sqrt(BLURRED.variance_mm2[-1]))
    total = np.zeros(len(places))
    for i, j in enumerate(near):
        to = at[j] - places[i]
        facing = (to * out[j]).sum(axis=1) < to @ normals[i]
        turned = out[j] @ normals[i] < 0.5
        square = (to**2).sum(axis=1)[facing & turned, None]
        profile = np.exp(-0.5 * square / BLURRED.variance_mm2) / (2.0 * np.pi * BLURRED.variance_mm2)
        total[i] = flux[lit][j][facing & turned] @ profile @ BLURRED.weight[:, 0]
    return total


def comparison_cells(
    renderer: dermis.Renderer,
    mesh: Mesh,
    way: Array,
    chosen: PointFilter,
    atlas: int,
    spacing: float,
    *,
    air: bool,
) -> str:
    """Return energy and relative RMSE against the sum over the surface, without and with transmission.

    air : also the energy against the sum less what crosses air
    """
    cells = []
    for transmission in ("none", "thin"):
        places, normals, light = scattered_light(renderer, mesh, way, MATTE, atlas, transmission=transmission)
        some = np.flatnonzero(chosen(places, normals))
        some = np.random.default_rng(5).permutation(some)[:3000]
        exact, red = integrated_light(mesh, way, places[some], spacing)[:, 0], light[some, 0]
        error = red - exact
        cells += [f"{red.sum() / exact.sum():.3f}", f"{np.sqrt((error**2).mean() / (exact**2).mean()):.1%}"]
    if air:
        inside = exact - light_across_air(mesh, way, places[some], normals[some])
        cells.append(f"{red.sum() / inside.sum():.3f}")
    return " | ".join(cells)


def wedge_rows(renderer: dermis.Renderer) -> str:
    """Return rows of red light on the dark face of wedges lit from behind, within 15 mm of their edge."""
    rows = []
    for angle in ANGLES:
        mesh = wedge(60.0, 0.01, 120.0 * float(np.tan(np.radians(angle / 2))), cells=16)

        def near(places: Array, normals: Array, half: float = angle / 2) -> NDArray[np.bool_]:
            dark = normals @ [-np.sin(np.radians(half)), 0.0, np.cos(np.radians(half))] > 0.99
            return np.asarray(dark & (places[:, 0] < -15.0) & (np.abs(places[:, 1]) < 15.0))

        cells = comparison_cells(renderer, mesh, np.array([0.0, 0.0, 1.0]), near, 512, 0.7, air=False)
        rows.append(f"| {angle:g}° | {cells} |")
    return "\n".join(rows)


def ear_rows(renderer: dermis.Renderer) -> str:
    """Return rows of red light on the dark side of heads' ears, lit from behind and from the front."""
    rows = []
    for name in ("lee_perry_smith", "human"):
        head = dermis.load_head(name, subdivide=0)
        mesh, centre = head.mesh, np.array(head.centre_mm)
        for side, z in (("behind", 1.0), ("the front", -1.0)):
            way = np.array([0.0, 0.0, z])

            def dark(
                places: Array, normals: Array, way: Array = way, centre: Array = centre
            ) -> NDArray[np.bool_]:
                local = places - centre
                ear = (np.abs(local[:, 0]) > EAR_DISTANCE_MM) & (np.abs(local[:, 1]) < 45.0)
                return np.asarray(ear & (normals @ way > 0.3))

            cells = comparison_cells(renderer, mesh, way, dark, ATLAS, 1.5, air=True)
            rows.append(f"| {name} | {side} | {cells} |")
    return "\n".join(rows)


def tables(adapter: str = "auto") -> dict[str, str]:
    """Return the tables by their names in the page's template."""
    renderer = dermis.Renderer(adapter)
    return {
        "thin_slabs": slab_rows(renderer),
        "thin_wedges": wedge_rows(renderer),
        "thin_ears": ear_rows(renderer),
    }
