"""What a frame reads, made from a scene: records for the shaders, matrices, and space for the results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.assets.head import Head
from dermis.errors import refuse
from dermis.gpu import ComputeProgram
from dermis.optics.gaussians import GaussianSum
from dermis.rendering.maps import HeadTextures
from dermis.rendering.projection import Matrix, ShadowView, depth_range, frame_of, perspective, shadow_view
from dermis.rendering.samples import pixel_samples
from dermis.rendering.stages.diffuse import Levels
from dermis.rendering.stages.nearest import Layers
from dermis.rendering.stages.post import Picture
from dermis.rendering.stages.shadows import ShadowMaps
from dermis.scene.camera import Camera
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.specular.fresnel import SKIN_F0

Floats = NDArray[np.float64]
# A Gaussian narrower than this is finer than texels and pores: it is lit again, not blurred.
_RELIT_MM2 = 0.1**2
_MOST_MATERIALS = 64
_WIDEST_SHADOW_FILTER = 6


@dataclass(frozen=True)
class Inputs:
    """Everything `draw_frame` touches.

    head, atlas, lit : resources by the shaders' names: geometry and maps; atlas; those, lights and shadows
    light_clips, shadow_key : a matrix for each shadow map, and what the maps would show
    scatters : whether light spreads below the surface
    blurred_mm2, level_weight, scattered : variances and weights of the blurred levels; texture of their sum
    view : record of the shading pass
    """

    head: HeadTextures
    atlas: dict[str, Any]
    lit: dict[str, Any]
    shadow_maps: ShadowMaps
    light_clips: list[Matrix]
    shadow_key: bytes
    scatters: bool
    levels: Levels
    blurred_mm2: Floats
    level_weight: Floats
    scattered: Any
    seen: Layers
    camera_clips: list[Matrix]
    view: Any
    picture: Picture
    exposure: float


@dataclass(frozen=True)
class Split:
    """A profile divided into the level that is lit again in the image and those that are blurred.

    relit, total : (3,) weight of the level that is not blurred, and of all
    blurred_mm2, weight : (k,) and (k, 3) of the blurred levels
    """

    relit: Floats
    total: Floats
    blurred_mm2: Floats
    weight: Floats


def split_profile(profile: GaussianSum, settings: Settings, white: bool) -> Split:
    """The profile as the frame uses it.

    white : renormalise each channel's weights to 1, so that the colour map alone gives the colour
    """
    weight = profile.weight / profile.albedo if white else profile.weight
    total = weight.sum(axis=0)
    if settings.technique == "none":
        return Split(total, total, np.empty(0), np.empty((0, 3)))
    if profile.variance_mm2[0] <= _RELIT_MM2:
        return Split(weight[0], total, profile.variance_mm2[1:], weight[1:])
    return Split(np.zeros(3), total, profile.variance_mm2, weight)


def camera_clips(camera: Camera, head: Head, settings: Settings) -> list[Matrix]:
    """World to clip space for each sample of the pixel."""
    eye, axes, half = _pinhole(camera, head, settings)
    whole = perspective(eye, axes, half, *depth_range(head.mesh, eye, axes[2]))
    width, height = settings.size
    clips = []
    for x, y in pixel_samples(settings.samples):
        shift = np.eye(4)
        shift[0, 3], shift[1, 3] = -2.0 * (x - 0.5) / width, 2.0 * (y - 0.5) / height
        clips.append(shift @ whole)
    return clips


def view_record(shade: ComputeProgram, scene: Scene, settings: Settings, split: Split) -> Any:
    """The shading pass' record: rays, samples and weights."""
    eye, axes, half = _pinhole(scene.camera, scene.head, settings)
    jitter = np.zeros((64, 4), np.float32)
    jitter[: settings.samples, :2] = pixel_samples(settings.samples)
    colours = np.zeros((_MOST_MATERIALS, 4), np.float32)
    materials = scene.head.mesh.materials
    if len(materials) > _MOST_MATERIALS:
        count = f"it has {len(materials)}"
        refuse(scene.head.name, f"at most {_MOST_MATERIALS} materials", count, "Join some groups")
    for index, material in enumerate(materials):
        colours[index, :3] = material.colour
    return shade.record(
        "Shade",
        eye=eye,
        samples=settings.samples,
        forward=axes[2],
        right=axes[0] * half[0],
        up=axes[1] * half[1],
        relit=split.relit,
        total=split.total,
        background=np.divide(settings.background, settings.exposure),
        material_colour=colours,
        jitter=jitter,
    )


def skin_record(program: ComputeProgram, scene: Scene, head: HeadTextures) -> Any:
    """The skin's parameters; a roughness map replaces the constant."""
    skin = scene.skin
    return program.record(
        "Skin",
        roughness=1.0 if scene.head.maps.roughness is not None else skin.roughness,
        rho_s=skin.rho_s,
        f0=SKIN_F0,
        mix=skin.mix,
        relief_band=head.relief_band,
        light_count=len(scene.lights),
    )


def light_views(scene: Scene, size: int) -> list[ShadowView | None]:
    """How each light sees the head; None for one without shadows."""
    centre = np.array(scene.head.centre_mm)
    return [
        shadow_view(light, centre, scene.head.mesh, size, f"light {index + 1}") if light.shadows else None
        for index, light in enumerate(scene.lights)
    ]


def light_records(program: ComputeProgram, scene: Scene, views: list[ShadowView | None]) -> Any:
    """The shader's array of lights.

    Raises DermisError for more lights than it holds.
    """
    centre = np.array(scene.head.centre_mm)
    record = program.record("Lights")
    if len(views) > len(record["light"]):
        refuse("lights", f"at most {len(record['light'])}", f"there are {len(views)}", "Leave some out")
    layer = 0
    for index, (light, view) in enumerate(zip(scene.lights, views, strict=True)):
        record["light"][index] = _light_record(program, light, centre, view, layer if view else -1)
        layer += view is not None
    return record


def _light_record(
    program: ComputeProgram,
    light: PointLight | SpotLight | DirectionalLight,
    centre: Floats,
    view: ShadowView | None,
    layer: int,
) -> Any:
    record = program.record("Light", irradiance=light.irradiance, layer=layer, reference_mm=1.0)
    texel = view.texel if view else 1.0
    if isinstance(light, DirectionalLight):
        record["kind"], distance = 2, 1.0
        record["direction"] = np.array(light.direction) / np.linalg.norm(light.direction)
    else:
        path = np.subtract(light.target, light.position)
        distance = float(np.linalg.norm(path))
        record["kind"] = 1 if isinstance(light, SpotLight) else 0
        record["position"], record["direction"] = np.array(light.position) + centre, path / distance
        record["reference_mm"] = distance
    if isinstance(light, SpotLight):
        record["cos_inner"] = np.cos(np.radians(light.inner_degrees))
        record["cos_outer"] = np.cos(np.radians(light.outer_degrees))
    if view:
        record["to_map"], record["texel"] = view.clip.T, texel
    # A tent of half width h fades over 2 h texels.
    record["half_width"] = np.clip(
        round(0.5 * light.softness_mm / (texel * distance)), 1, _WIDEST_SHADOW_FILTER
    )
    return record


def _pinhole(camera: Camera, head: Head, settings: Settings) -> tuple[Floats, Any, tuple[float, float]]:
    """Eye, axes, and the tangents of the half angles of view."""
    eye = np.array(camera.position) + head.centre_mm
    path = np.subtract(camera.target, camera.position)
    half = 0.5 * camera.frame_mm / float(np.linalg.norm(path))
    width, height = settings.size
    return eye, frame_of(path, np.array(camera.up)), (half * width / height, half)
