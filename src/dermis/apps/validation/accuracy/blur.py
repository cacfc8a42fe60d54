"""Errors of scattered light computed by blurs on the atlas: impulse responses, curved surfaces, seams."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import zoom

import dermis
from dermis.apps.validation.pages import add_tests_to_path, data_file, print_tables
from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas, cached_atlas
from dermis.frame.features.atlas import passes as atlas_passes
from dermis.frame.features.atlas.textures import upload_atlas
from dermis.frame.features.diffusion import blur as diffuse
from dermis.frame.features.diffusion.pyramid import Blur, PyramidLevels, choose_halvings, make_levels
from dermis.frame.features.shape.mesh import upload_geometry
from dermis.frame.features.shape.shape import evaluate_rest_shape, shape_tables
from dermis.frame.programs import level_format
from dermis.frame.renderer import Renderer
from dermis.frame.seams import SEAM_METHODS
from dermis.gpu import CommandList, Device, download, open_device, upload
from dermis.gpu.textures import float16_store_rounding
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import plane, uv_sphere
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene import Scene, Settings, Skin
from dermis.scene.lights import DirectionalLight, Light, StripeLight

if TYPE_CHECKING:
    from atlas_reading import Points  # in the folder tests, like other modules that functions import

BLUR_PROFILE = load_profile("gpu-gems-3")
Array = NDArray[np.floating]
Mask = NDArray[np.bool_]
PointFilter = Callable[[Array], Mask]
FLAT_PATCH_SIDE = 256  # side of flat patches [texels]
MAKEHUMAN_HEAD_FILE = "heads/makehuman/head_young_male_light.obj"
SPHERE_RADII_MM = (5.0, 10.0, 20.0, 50.0, 100.0)
BALL_ATLAS_SIDE, HEAD_ATLAS_SIDE = 320, 1024
STRIPE_SPACING_MM, STRIPE_WIDTH_MM = 12.0, 6.0  # of stripes of light across seams
MIN_FACING_COSINE = 0.4  # least cosine between the normal at a seam and the light


def print_blur_errors(adapter: str = "auto") -> None:
    """Print tables of the errors of blurred light: for a single lit texel, on spheres and across seams.

    The tables of spheres and of seams need the folder `tests` of a checkout.
    """
    print_tables({name: str(text) for name, text in blur_error_texts(open_device(adapter)).items()})
    print_tables(curvature_and_seam_tables(adapter))


def blur_error_texts(device: Device) -> dict[str, object]:
    """Return texts on the errors of blurred light for docs/templates/accuracy.md, keyed by placeholder."""
    return {
        "rows": "\n".join(lit_texel_row(device, density) for density in (0.75, 1.0, 1.5, 3.0, 6.0, 12.0)),
        "leaning": "\n".join(sheared_uv_row(device, degrees) for degrees in (90, 80, 60, 45)),
        "constant": f"{constant_light_error(device):.1e}",
        "rounding": float16_store_rounding(device),
    }


def blurred_levels(device: Device, mesh: Mesh, irradiance: Array, stretch_mode: str = "full") -> list[Array]:
    """Blur light on the atlas of a mesh; return all pyramid levels (n, n), resampled to full resolution.

    irradiance : (n, n) irradiance of the texels of the atlas
    stretch_mode : "full" to correct blurs for uv distortion, or "axes" to ignore the angle between u and v
    """
    levels, blur = blur_light(
        device, mesh, build_atlas(mesh, len(irradiance)), irradiance[..., None], stretch_mode
    )
    return [resampled_level(device, levels, blur, k + 1) for k in range(len(blur.variance_mm2))]


def lit_texel_row(device: Device, texels_per_mm: float) -> str:
    """Return a Markdown row with two errors of blurred light that comes from a single lit texel.

    The first is the largest difference from the analytic sum of Gaussians, divided by the peak of that sum.
    The second is the relative error of the energy. The surface is flat.

    texels_per_mm : resolution of the atlas on the surface
    """
    profile = load_profile("gpu-gems-3")
    light = np.zeros((FLAT_PATCH_SIDE, FLAT_PATCH_SIDE), np.float32)
    middle = FLAT_PATCH_SIDE // 2
    light[middle, middle] = 1.0
    levels = blurred_levels(device, plane(FLAT_PATCH_SIDE / texels_per_mm), light)
    y, x = np.mgrid[:FLAT_PATCH_SIDE, :FLAT_PATCH_SIDE] - middle
    r2 = (x**2 + y**2) / texels_per_mm**2
    blurred = GaussianSum("blurred levels", profile.variance_mm2[1:], profile.weight[1:])
    exact = blurred.radiant_exitance(np.sqrt(r2))[..., 0] / texels_per_mm**2
    total = np.tensordot(blurred.weight[:, 0], levels, axes=1)
    outside = x**2 + y**2 > 1.5**2
    shape = np.abs(total - exact)[outside].max() / exact.max()
    energy = total.sum() / blurred.albedo[0] - 1
    return f"| {texels_per_mm:g} | {100 * shape:.2f} % | {100 * energy:+.4f} % |"


def sheared_uv_row(device: Device, shear_degrees: float) -> str:
    """Return a Markdown row with errors of the blur on a flat surface whose uv axes are sheared.

    One texel is lit. The width of the blurred spot is measured along the surface and divided by the exact
    width. The first cell has the angle between the uv axes. The next two cells have the smallest and the
    largest width over all directions, for a blur that ignores this angle. The last two cells have the same
    widths for a blur that corrects for this angle.

    shear_degrees : angle between the uv axes on the flat surface [degrees]
    """
    flat = plane(FLAT_PATCH_SIDE / 3.0)
    shear = np.cos(np.radians(shear_degrees)), np.sin(np.radians(shear_degrees))
    positions = flat.positions.copy()
    positions[:, 0] += shear[0] * positions[:, 1]
    positions[:, 1] *= shear[1]
    mesh = build_mesh(positions, flat.uv, flat.triangles, flat.material, flat.materials)
    light = np.zeros((FLAT_PATCH_SIDE, FLAT_PATCH_SIDE), np.float32)
    light[FLAT_PATCH_SIDE // 2, FLAT_PATCH_SIDE // 2] = 1.0
    y, x = np.mgrid[:FLAT_PATCH_SIDE, :FLAT_PATCH_SIDE] - FLAT_PATCH_SIDE // 2
    position = np.stack([x - shear[0] * y, -shear[1] * y]) / 3.0  # v points down
    target_variance = load_profile("gpu-gems-3").variance_mm2[-1]
    cells = []
    for stretch in ("axes", "full"):
        spot = blurred_levels(device, mesh, light, stretch)[-1].astype(float)
        covariance = np.einsum("iyx,jyx,yx->ij", position, position, spot) / spot.sum()
        cells += [f"{width:.3f}" for width in np.sqrt(np.linalg.eigvalsh(covariance) / target_variance)]
    return f"| {shear_degrees:g}° | {' | '.join(cells)} |"


def constant_light_error(device: Device) -> float:
    """Return the largest error of a uniform irradiance of 1 after it is blurred on a sphere's atlas [-]."""
    atlas = build_atlas(uv_sphere(100.0), FLAT_PATCH_SIDE)
    levels = blurred_levels(device, uv_sphere(100.0), atlas.coverage.astype(np.float32))
    return max(float(np.abs(level[atlas.coverage] - 1).max()) for level in levels)


def curvature_and_seam_tables(adapter: str) -> dict[str, str]:
    """Return Markdown rows on curvature and seams for docs/templates/techniques.md, keyed by placeholder."""
    add_tests_to_path()
    renderer = dermis.Renderer(adapter)
    curved = [sphere_blur_row(renderer, radius) for radius in SPHERE_RADII_MM]
    return {"curvature": "\n".join(curved), "seams": "\n".join(seam_rows(renderer))}


def sphere_blur_row(renderer: Renderer, radius_mm: float) -> str:
    """Return a Markdown row that compares three ways to blur light on a sphere.

    They are the blur on the atlas, the heat equation on the sphere, and an integral over the sphere with
    weights that depend on Euclidean distance. Each blurs by the widest Gaussian of `BLUR_PROFILE`. The
    irradiance is proportional to the coordinate x, so that each blur only scales it by a factor. The row
    contains the radius and the three factors.
    """
    from atlas_reading import shown
    from cut_meshes import cut_sphere

    mesh = cut_sphere(radius_mm, 20)
    atlas = build_atlas(mesh, BALL_ATLAS_SIDE, "stitched")
    light = np.nan_to_num(shown(atlas, mesh, own=True))[..., :1] / radius_mm
    remaining = widest_gaussian_level(renderer, *blur_light(renderer.device, mesh, atlas, light))
    density = np.maximum(atlas.stretch.astype(float).prod(axis=-1, keepdims=True), 1e-6)
    area = atlas.lit_mask[..., None] / density
    map_fraction = (area * remaining * light).sum() / (area * light**2).sum()
    v = BLUR_PROFILE.variance_mm2[-1] / radius_mm**2
    decay = np.exp(-2 / v)
    chords = (1 - decay) - v * (1 - (1 + 2 / v) * decay)
    return f"| {radius_mm:g} | {map_fraction:.3f} | {np.exp(-v):.3f} | {chords:.3f} |"


def blur_light(
    device: Device, mesh: Mesh, atlas: Atlas, irradiance: Array, stretch_mode: str = "full"
) -> tuple[PyramidLevels, Blur]:
    """Blur grey light on the atlas of a mesh, and return the pyramid levels and the parameters of the blur.

    The light is blurred by each Gaussian of `BLUR_PROFILE` except the narrowest.

    irradiance : (n, n, 1) irradiance of the texels of the atlas
    stretch_mode : "full" to correct blurs for uv distortion, or "axes" to ignore the angle between u and v
    """
    textures, variance = upload_atlas(device, atlas, stretch_mode), BLUR_PROFILE.variance_mm2[1:]
    max_halvings = len(textures.mips_for_blurs("repeated")) - 1
    halvings = choose_halvings(variance, textures.median_texels_per_mm, max_halvings)
    blur = Blur(variance, BLUR_PROFILE.weight[1:], halvings)
    levels = make_levels(device, len(irradiance), (halvings,), level_format(device))
    upload(
        device, levels.stacks[0], np.dstack([irradiance, irradiance, irradiance, np.ones_like(irradiance)])
    )
    frame = CommandList(device)
    head = Head("", mesh, Maps())
    shape = evaluate_rest_shape(device, shape_tables(device, head), head.positions_mm)
    atlas_passes.draw_stretch(frame, upload_geometry(device, mesh, atlas, shape), textures)
    diffuse.draw(frame, levels, textures, blur)
    frame.submit()
    return levels, blur


def resampled_level(device: Device, levels: PyramidLevels, blur: Blur, level_index: int) -> Array:
    """Return a pyramid level (n, n), resampled bilinearly to the full resolution of the atlas.

    level_index : 0 for the light before blurs, k for the light blurred by the k-th Gaussian that is used
    """
    halvings = blur.halvings[level_index]
    layer = download(device, levels.stacks[halvings], layer=level_index - levels.first[halvings])[..., 0]
    return np.asarray(zoom(layer, 2**halvings, order=1, mode="nearest", grid_mode=True))


def widest_gaussian_level(renderer: Renderer, levels: PyramidLevels, blur: Blur) -> Array:
    """Return the light (n, n, 1) blurred by the widest Gaussian, at the full resolution of the atlas."""
    return resampled_level(renderer.device, levels, blur, len(blur.halvings) - 1)[..., None]


def seam_rows(renderer: Renderer) -> list[str]:
    """Return Markdown rows with the discontinuity of scattered light across seams, for several meshes.

    Each cell has the mean and the 95th percentile of the discontinuity relative to the light [%].
    """
    from cut_meshes import cut_sphere

    human = dermis.load_head("human")
    makehuman = replace(
        dermis.load_head(data_file(MAKEHUMAN_HEAD_FILE), unit_mm=100, subdivide=0), maps=Maps()
    )
    rows = (
        (
            "sphere in six charts",
            Head("sphere", cut_sphere(30.0, 20), Maps()),
            BALL_ATLAS_SIDE,
            all_points_mask,
        ),
        ("human, neck and back of the head", human, HEAD_ATLAS_SIDE, visible_seams_mask),
        ("human, eye sockets and inside of the mouth", human, HEAD_ATLAS_SIDE, hidden_seams_mask),
        ("MakeHuman, neck", makehuman, HEAD_ATLAS_SIDE, neck_mask),
        ("MakeHuman, back of the head", makehuman, HEAD_ATLAS_SIDE, back_of_head_mask),
    )
    return [seam_row(renderer, *row) for row in rows]


def all_points_mask(positions: Array) -> Mask:
    """Return a mask (n,) that selects all positions (n, 3)."""
    return np.ones(len(positions), bool)


def neck_mask(positions: Array) -> Mask:
    """Return the mask of positions on and below the neck."""
    return np.asarray((positions[:, 1] < -90.0) & (positions[:, 2] < 60.0))


def back_of_head_mask(positions: Array) -> Mask:
    """Return the mask of positions on the back of the head."""
    return np.asarray((positions[:, 1] > -90.0) & (positions[:, 2] < -30.0))


def visible_seams_mask(positions: Array) -> Mask:
    """Return the mask of positions where seams of the package's human are visible: neck and back."""
    return np.asarray(neck_mask(positions) | back_of_head_mask(positions))


def hidden_seams_mask(positions: Array) -> Mask:
    """Return the mask of positions where seams of the package's human are hidden: eye sockets and mouth."""
    return ~visible_seams_mask(positions)


def seam_row(
    renderer: Renderer, row_title: str, head: Head, atlas_side: int, point_filter: PointFilter
) -> str:
    """Return a Markdown row with the discontinuity of light across seams, with one cell per seam method.

    atlas_side : side of the atlas [texel]
    point_filter : function that returns the mask of the seam points to use, given their positions
    """
    first, second = seam_side_points(head, point_filter)
    cells = []
    for method in SEAM_METHODS:
        jumps = seam_discontinuities(renderer, striped_scene(head), method, atlas_side, first, second)
        cells.append(f"{100 * jumps.mean():.1f} / {100 * np.percentile(jumps, 95):.1f}")
    return f"| {row_title} | {len(first.triangle)} | {' | '.join(cells)} |"


def seam_side_points(head: Head, point_filter: PointFilter) -> tuple[Points, Points]:
    """Return points on one side of the seams of a head, and the opposite points on the other side.

    Only points whose normals point roughly forwards or backwards are returned, because the light of
    `striped_scene` comes from the front and from the back.

    point_filter : function that returns the mask of the seam points to use, given their positions
    """
    from atlas_reading import Points, seam_points

    mesh = head.mesh
    first, second = seam_points(mesh)
    positions = first.on(mesh.positions[mesh.triangles]) - head.centre_mm
    selected = point_filter(positions) & (
        np.abs(first.on(mesh.normals[mesh.triangles])[:, 2]) > MIN_FACING_COSINE
    )
    for size in (BALL_ATLAS_SIDE, HEAD_ATLAS_SIDE):
        for layout in ("mesh", "stitched"):
            mapped = cached_atlas(head.topology_head.mesh, size, layout).mapped
            selected &= mapped[first.triangle] & mapped[second.triangle]
    first, second = (Points(one.triangle[selected], one.weights[selected]) for one in (first, second))
    return first, second


def striped_scene(head: Head) -> Scene:
    """Return a scene with a head that is lit from the front and from the back.

    From each of these directions come sharp stripes of light and weak uniform light.
    """
    x = head.mesh.positions[:, 0] - head.centre_mm[0]
    positions = np.arange(max(x.min(), -90.0), min(x.max(), 90.0), STRIPE_SPACING_MM)
    stripe = partial(StripeLight, up=(0.4, 1, 0), width_mm=STRIPE_WIDTH_MM, shadows=False)
    lights: list[Light] = []
    for direction in ((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)):
        lights += [stripe(direction=direction, position=(x, 0, 0)) for x in positions]
        lights.append(DirectionalLight(direction=direction, irradiance=(1, 1, 1), shadows=False))
    skin = Skin(profile="gpu-gems-3", albedo="profile", specular="none", direction="lambertian")
    return Scene(replace(head, maps=Maps()), lights=lights, skin=skin)


def seam_discontinuities(
    renderer: Renderer,
    scene: Scene,
    seam_method: str,
    atlas_side: int,
    first_side: Points,
    second_side: Points,
) -> Array:
    """Return the relative differences (n,) between the scattered red light on the two sides of seams.

    seam_method : key of `SEAM_METHODS`
    atlas_side : side of the atlas [texel]
    first_side, second_side : n points on one side of the seams, and the opposite points
    """
    from atlas_reading import lit_at

    values = {"size": (16, 16), "atlas": atlas_side, "seams": seam_method, "transmission": "none"}
    settings = Settings.model_validate(values | {"interreflection": False})
    renderer.draw(scene, settings)
    scattered = renderer.prepare(scene, settings).resources.scattered
    light = download(renderer.device, scattered).astype(float)[..., :3]
    atlas = cached_atlas(scene.head.topology_head.mesh, atlas_side, SEAM_METHODS[seam_method].layouts[0])
    a, b = (lit_at(light, atlas, points)[:, 0] for points in (first_side, second_side))
    return np.abs(a - b) / np.maximum((a + b) / 2, 1e-9)
