"""Errors of lighting: environments, area lights, ambient occlusion, energy in white furnace tests."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

import dermis
from dermis.apps.validation.pages import print_tables
from dermis.atlas.build import cached_atlas
from dermis.environment.isotropic_fits import LOBE_TABLE_ROUGHNESSES, ROUGHNESS_COUNT, VIEW_COUNT
from dermis.environment.isotropic_lobes import isotropic_lobe_table
from dermis.environment.panorama import (
    load_panorama,
    resample_panorama,
    split_suns,
    texel_directions,
    texel_solid_angles,
)
from dermis.environment.prefilter import (
    LAYER_ROUGHNESSES,
    MAX_LAYER_ROUGHNESS,
    MIN_LAYER_ROUGHNESS,
    PrefilteredPanorama,
    prefilter,
)
from dermis.frame.features.occlusion.baked import SKY_DIRECTION_COUNT, bake_occlusion
from dermis.frame.lights.rectangle import facing_irradiance
from dermis.frame.projection import view_axes_array
from dermis.mesh.head import Head
from dermis.mesh.primitives import uv_sphere
from dermis.scene import Environment, Scene, Settings, Skin, load_lights
from dermis.scene.lights import PointLight, RectangleLight
from dermis.specular.albedo import directional_albedo
from dermis.specular.cosines import Cosines
from dermis.specular.kelemen import kelemen

PANORAMAS = ("royal_esplanade", "lebombo")
VIEW_DEGREES = (0, 15, 30, 45, 60, 70, 75, 80, 85)  # angle between view and normal [degrees]
MAX_ROUGHNESS_FOR_FINE_TEXELS = 0.25  # below this roughness, lobes are summed over smaller texels
Array = NDArray[np.floating]
UP_AXIS = np.array([0.0, 1.0, 0.0])


def print_light_errors(adapter: str = "auto") -> None:
    """Print tables with errors of environments, area lights, ambient occlusion and white furnace tests."""
    print_tables(light_error_tables(adapter))


def sample_panorama(panorama_image: Array, directions: Array) -> Array:
    """Return the radiance (n, 3) of a panorama in given directions, interpolated as in the shader.

    panorama_image : (h, w, 3) panorama
    directions : (n, 3) directions
    """
    height, width = panorama_image.shape[:2]
    x = (0.5 + np.arctan2(directions[:, 0], -directions[:, 2]) / (2 * np.pi)) * width - 0.5
    y = np.arccos(np.clip(directions[:, 1], -1, 1)) / np.pi * height - 0.5
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    total = np.zeros((len(directions), 3))
    for i in (0, 1):
        for j in (0, 1):
            weight = np.abs(1 - i - (y - top)) * np.abs(1 - j - (x - left))
            total += weight[:, None] * panorama_image[np.clip(top + i, 0, height - 1), (left + j) % width]
    return total


def normalise(vectors: Array) -> Array:
    """Return vectors (..., 3) scaled to length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


@cache
def prefiltered_panorama(
    panorama_name: str, row_count: int = 256
) -> tuple[Array, Array, PrefilteredPanorama]:
    """Return directions (n, 3) and light (n, 3) of a panorama's texels, and the prefiltered panorama.

    The light of a texel is its radiance times its solid angle. Suns are removed from the panorama.

    row_count : number of rows to which the panorama is resampled before its texels are listed
    """
    radiance = resample_panorama(split_suns(load_panorama(panorama_name))[0], row_count)
    light = radiance * texel_solid_angles(*radiance.shape[:2])[..., None]
    return (
        texel_directions(*radiance.shape[:2]).reshape(-1, 3),
        light.reshape(-1, 3),
        prefilter(panorama_name),
    )


def irradiance_error(panorama_name: str, normal_count: int = 200) -> float:
    """Return the largest relative error of the irradiance from a prefiltered panorama, over random normals.

    normal_count : number of random normals for which the irradiance is compared
    """
    towards, light, prefiltered = prefiltered_panorama(panorama_name)
    normals = normalise(np.random.default_rng(1).normal(size=(normal_count, 3)))
    exact = np.array([np.maximum(towards @ normal, 0) @ light for normal in normals])
    return float(np.abs(sample_panorama(prefiltered.layers[0], normals) / exact - 1).max())


def reflection_error(
    panorama_name: str, roughness_m: float, view_degrees: float, normal_count: int = 320
) -> float:
    """Return the relative RMS error of the radiance that a specular lobe reflects, over random normals.

    The radiance from lookups in a prefiltered panorama is compared with a sum over the panorama's texels.

    roughness_m : roughness of the specular lobe
    view_degrees : angle between view and normal [degrees]
    normal_count : number of random normals for which the radiance is compared
    """
    cosine = float(np.cos(np.radians(view_degrees)))
    towards, light, prefiltered = prefiltered_panorama(
        panorama_name, 512 if roughness_m < MAX_ROUGHNESS_FOR_FINE_TEXELS else 256
    )
    rng = np.random.default_rng(2)
    normals = normalise(rng.normal(size=(normal_count, 3)))
    along = normalise(np.cross(normals, rng.normal(size=(normal_count, 3))))
    views = cosine * normals - np.sqrt(1 - cosine**2) * along
    pairs = zip(normals, views, strict=True)
    exact = [reflected_radiance(towards, light, normal, view, roughness_m) for normal, view in pairs]
    mirror_direction = 2 * cosine * normals - views
    tangent = cosine * along - np.sqrt(1 - cosine**2) * normals
    bitangent, sampled = np.cross(normals, along), np.zeros((normal_count, 3))
    for x, y, lobe_roughness, weight in lobe_parameters(cosine, roughness_m):
        direction = normalise(2 * (x * tangent + y * bitangent) + (1 - x**2 - y**2) * mirror_direction)
        sampled += weight * lobe_radiance(prefiltered.layers, direction, lobe_roughness)
    error = directional_albedo(cosine, roughness_m) * sampled - np.array(exact)
    return float(np.sqrt((error**2).mean()) / np.mean(exact))


def reflected_radiance(
    texel_directions: Array, texel_light: Array, normal: Array, view: Array, roughness_m: float
) -> Array:
    """Return the radiance that a specular lobe reflects, as a sum over all texels of a panorama.

    Texels where the lobe is below 1e-10 of its peak are skipped.

    texel_directions : (n, 3) directions of the texels
    texel_light : (n, 3) radiance of the texels, multiplied by their solid angles
    normal, view : (3,) unit vectors
    roughness_m : roughness of the lobe
    """
    n_l, n_v, v_l = texel_directions @ normal, float(normal @ view), texel_directions @ view
    n_h = (n_l + n_v) / np.sqrt(np.maximum(2 + 2 * v_l, 1e-12))
    near = np.flatnonzero((n_l > 0) & (n_h > 1 / np.sqrt(1 + (4.8 * roughness_m) ** 2)))
    v_h = np.sqrt(0.5 + 0.5 * v_l[near])
    angles = Cosines(n_l[near], np.full(len(near), n_v), n_h[near], v_h)
    return np.asarray((kelemen(angles, roughness_m) * n_l[near]) @ texel_light[near])


def lobe_parameters(cosine: float, roughness_m: float) -> Array:
    """Return the isotropic lobes (k, 4) that approximate a specular lobe: directions, roughness and weights.

    The first two columns are the coordinates of the direction, in stereographic projection about the mirror
    direction. The third is the roughness, the fourth the weight.

    cosine : cosine between view and normal
    roughness_m : roughness of the specular lobe
    """
    x = np.sqrt(cosine) * (VIEW_COUNT - 1)
    y = np.interp(np.log(roughness_m), np.log(LOBE_TABLE_ROUGHNESSES), np.arange(ROUGHNESS_COUNT))
    j, i = min(int(x), VIEW_COUNT - 2), min(int(y), ROUGHNESS_COUNT - 2)
    rows = isotropic_lobe_table()[i : i + 2, j : j + 2]
    return np.asarray(np.einsum("i,j,ijlk->lk", [1 - (y - i), y - i], [1 - (x - j), x - j], rows))


def lobe_radiance(prefiltered_layers: Array, directions: Array, roughness_m: float) -> Array:
    """Return the radiance (k, 3) of a prefiltered panorama in the directions of isotropic lobes.

    The radiance is interpolated between the two layers whose roughness is nearest to that of the lobes.

    prefiltered_layers : (n, h, w, 3) layers of the prefiltered panorama, in order of roughness
    directions : (k, 3) directions of the lobes
    roughness_m : roughness of the lobes
    """
    level = (
        (len(LAYER_ROUGHNESSES) - 1)
        * np.log(roughness_m / MIN_LAYER_ROUGHNESS)
        / np.log(MAX_LAYER_ROUGHNESS / MIN_LAYER_ROUGHNESS)
    )
    low = int(np.clip(level, 0, len(LAYER_ROUGHNESSES) - 2))
    f = float(np.clip(level - low, 0, 1))
    below, above = (sample_panorama(prefiltered_layers[1 + k], directions) for k in (low, low + 1))
    return np.asarray((1 - f) * below + f * above)


def furnace_extremes(
    renderer: dermis.Renderer, head: Head, energy_scheme: str, **setting_values: str
) -> Array:
    """Return minimum, mean and maximum ratio of outgoing to incoming radiance in a white furnace test.

    In this test, a head with a white albedo map is lit by a uniform environment.

    energy_scheme : energy conservation scheme of the skin
    setting_values : values of further render settings, by name
    """
    white_head = replace(head, maps=replace(head.maps, colour=np.ones((4, 4, 3), np.float32)))
    skin = Skin.preset("deck-2007").replace(energy=energy_scheme)
    scene = Scene(white_head, environment=Environment(name="uniform"), skin=skin)
    settings = Settings.model_validate({"size": (384, 384), "atlas": 1024, "samples": 1, **setting_values})
    picture = renderer.draw(scene, settings).linear_rgba()
    covered = picture[picture[..., 3] == 1][:, 1]
    return np.array([covered.min(), covered.mean(), covered.max()])


def furnace_rows(renderer: dermis.Renderer) -> str:
    """Return Markdown rows with the results of `furnace_extremes` for several heads and settings."""
    ball = dermis.Head("ball", uv_sphere(115.0), dermis.load_head("lee_perry_smith", subdivide=0).maps)
    ball = replace(ball, maps=replace(ball.maps, normal=None, height=None, specular=None, roughness=None))
    heads = {"sphere": ball, "scan": dermis.load_head("lee_perry_smith", regions="none", subdivide=0)}
    rows = []
    for name, head in heads.items():
        for energy, occlusion, transmission in (
            ("none", "none", "none"),
            ("published", "none", "none"),
            ("full", "none", "none"),
            ("full", "baked", "none"),
            ("full", "none", "thin"),
            ("full", "baked", "thin"),
        ):
            values = {"occlusion": occlusion, "transmission": transmission}
            least, mean, most = furnace_extremes(renderer, head, energy, **values)
            cells = f"{name} | {energy} | {occlusion} | {transmission}"
            rows.append(f"| {cells} | {least:.3f} | {mean:.4f} | {most:.3f} |")
    return "\n".join(rows)


def as_point_lights(light: RectangleLight, lights_per_side: int = 8) -> list[PointLight]:
    """Return a grid of point lights in place of a rectangle light; each has its own shadow map.

    lights_per_side : number of point lights along each side
    """
    position, target = np.array(light.position), np.array(light.target)
    distance = float(np.linalg.norm(target - position))
    right, up, forward = view_axes_array(target - position, UP_AXIS)
    area = light.width_mm * light.height_mm / lights_per_side**2
    radiance = np.array(light.irradiance) / facing_irradiance(light.width_mm, light.height_mm, distance)
    points = []
    for index in range(lights_per_side**2):
        x, y = ((2 * k + 1) / lights_per_side - 1 for k in divmod(index, lights_per_side))
        point = position + 0.5 * (x * light.width_mm * right + y * light.height_mm * up)
        to_target = target - point
        irradiance = radiance * area * (normalise(to_target) @ forward) / (to_target @ to_target)
        points.append(PointLight(position=tuple(point), irradiance=tuple(irradiance), softness_mm=2.0))
    return points


def soft_shadow_error(renderer: dermis.Renderer, light_preset: str) -> tuple[float, float]:
    """Return the mean and the RMS error of a head's radiance under an area light with shadows [-].

    The reference has 64 point lights in place of the area light. Both errors are divided by the mean radiance
    of the reference.

    light_preset : name of the light preset
    """
    light = load_lights(light_preset)[0]
    assert isinstance(light, RectangleLight)
    head = dermis.load_head("lee_perry_smith", subdivide=0)
    settings = Settings(size=(384, 384), atlas=256, samples=1, technique="none", shadow_size=1024)
    picture, exact = (
        renderer.draw(Scene(head, lights=lights), settings).linear()
        for lights in ([light], as_point_lights(light))
    )
    lit = exact.max(axis=-1) > 0
    error = (picture - exact)[lit]
    return float(error.mean() / exact[lit].mean()), float(np.sqrt((error**2).mean()) / exact[lit].mean())


def occlusion_error(renderer: dermis.Renderer) -> float:
    """Return the RMS error of ambient occlusion on the head "lee_perry_smith" [-].

    Ambient occlusion is the fraction of the sky that a point of the surface sees. The reference is computed
    with 1024 directions.
    """
    head = dermis.load_head("lee_perry_smith", subdivide=0)
    inputs = renderer.prepare(Scene(head), Settings(size=(64, 64), atlas=512, samples=1))
    texels, atlas = inputs.layouts[0].atlas.resources["atlas"], cached_atlas(head.mesh, 512, "stitched")
    ours, reference = (
        bake_occlusion(renderer.device, head, atlas, inputs.bindings, texels, 512, count)[:512]
        for count in (SKY_DIRECTION_COUNT, 1024)
    )
    return float(np.sqrt(np.nanmean((ours - reference) ** 2)))


def light_error_tables(adapter: str = "auto") -> dict[str, str]:
    """Return texts on errors of lighting, keyed by placeholder of docs/templates/accuracy.md."""
    renderer = dermis.Renderer(adapter)
    shadows = [(rig, *soft_shadow_error(renderer, rig)) for rig in ("window", "top", "rim")]
    return {
        "irradiance": f"{max(map(irradiance_error, PANORAMAS)):.1e}",
        "reflections": "\n".join(
            f"| {name} | {m} | "
            + " | ".join(f"{100 * reflection_error(name, m, angle):.1f}" for angle in VIEW_DEGREES)
            + " |"
            for name in PANORAMAS
            for m in (0.15, 0.2, 0.3, 0.45, 0.6)
        ),
        "furnaces": furnace_rows(renderer),
        "soft_shadows": "\n".join(f"| {rig} | {bias:+.1%} | {rms:.1%} |" for rig, bias, rms in shadows),
        "occlusion": f"{occlusion_error(renderer):.3f}",
        "directions": str(SKY_DIRECTION_COUNT),
    }
