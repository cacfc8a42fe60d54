"""What a frame reads, made from a scene: records for the shaders, matrices, and space for the results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.assets.head import Head
from dermis.errors import refuse
from dermis.gpu import ComputeProgram
from dermis.optics.fits.single import single_gaussian
from dermis.optics.gaussians import GaussianSum
from dermis.rendering.geometry import HeadTextures
from dermis.rendering.layout import Layout
from dermis.rendering.levels import Levels
from dermis.rendering.pre_integrated import PreIntegrated
from dermis.rendering.projection import Matrix, depth_range, frame_of, perspective
from dermis.rendering.samples import pixel_samples
from dermis.rendering.stages.bloom import Glow
from dermis.rendering.stages.nearest import Layers
from dermis.rendering.stages.post import Picture
from dermis.rendering.stages.screen_space import ScreenSpread
from dermis.rendering.stages.shadows import ShadowMaps
from dermis.rendering.stages.variants import Switches
from dermis.scene.camera import Camera
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
# A Gaussian narrower than this is finer than texels and pores: it is lit again, not blurred.
_RELIT_MM2 = 0.1**2
_MOST_MATERIALS = 64
_PARTS = {"all": (1.0, 1.0), "diffuse": (1.0, 0.0), "specular": (0.0, 1.0)}  # from below, off the surface
WITHOUT_ATLAS = ("none", "screen-space", "pre-integrated")
"""Techniques that do not spread light over the atlas."""


@dataclass(frozen=True)
class Inputs:
    """Everything `draw_frame` touches.

    layouts : atlases that light is spread on; the first is the one that is looked at
    light_clips, shadow_key : a matrix for each shadow map, and what the maps would show
    scatters : whether light spreads below the surface
    scale : what light is multiplied with in the blurred levels
    blurred_mm2, level_weight : variances and weights of the blurred levels
    edge, clear : what blurs find beyond a chart's edge, and the light of empty texels
    scattered : texture of the light that leaves below the surface
    view, switches : record of the shading pass, and the values of its `override`s
    light_switches : those of the irradiance pass
    suns : lights that the environment adds
    gaussians : terms of the profile
    spread : how light spreads over the picture, None when it does not
    glow : space for the bloom, None without one
    """

    head: HeadTextures
    layouts: list[Layout]
    shadow_maps: ShadowMaps
    light_clips: list[Matrix]
    shadow_key: bytes
    scatters: bool
    levels: Levels
    scale: float
    blurred_mm2: Floats
    level_weight: Floats
    edge: str
    clear: Floats
    scattered: Any
    seen: Layers
    camera_clips: list[Matrix]
    view: Any
    switches: Switches
    light_switches: Switches
    suns: int
    gaussians: int
    picture: Picture
    spread: ScreenSpread | None
    glow: Glow | None
    settings: Settings

    @property
    def lit(self) -> dict[str, Any]:
        """Of the layout that is looked at."""
        return self.layouts[0].lit


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
    if settings.technique == "one-blur":
        profile = single_gaussian(profile)
    weight = profile.weight / profile.albedo if white else profile.weight
    total = weight.sum(axis=0)
    if settings.technique in WITHOUT_ATLAS:
        return Split(total, total, np.empty(0), np.empty((0, 3)))
    if profile.variance_mm2[0] <= _RELIT_MM2 and settings.technique != "one-blur":
        return Split(weight[0], total, profile.variance_mm2[1:], weight[1:])
    return Split(np.zeros(3), total, profile.variance_mm2, weight)


def camera_clips(camera: Camera, head: Head, settings: Settings) -> list[Matrix]:
    """World to clip space for each sample of the pixel."""
    eye, axes, half = _pinhole(camera, head, settings)
    whole = perspective(eye, axes, half, *depth_range(head.mesh, eye, axes[2]))
    width, height = settings.size
    shift = (pixel_samples(settings.samples) - 0.5) * (-2.0 / width, 2.0 / height)
    clips = np.repeat(whole[None], len(shift), axis=0)
    clips[:, :2] += shift[..., None] * whole[3]
    return list(clips)


def view_record(
    shade: ComputeProgram, scene: Scene, settings: Settings, split: Split, pre: PreIntegrated | None = None
) -> Any:
    """The shading pass' record: rays, samples and weights.

    pre : tables of pre-integrated skin and their scales
    """
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
    record = shade.record(
        "Shade",
        eye=eye,
        samples=settings.samples,
        forward=axes[2],
        right=axes[0] * half[0],
        up=axes[1] * half[1],
        relit=split.relit,
        total=split.total,
        shown=_PARTS[settings.parts],
        background=np.divide(settings.background, settings.exposure),
        material_colour=colours,
        jitter=jitter,
    )
    if pre:
        record["pre"] = pre.record(shade)
    return record


def _pinhole(camera: Camera, head: Head, settings: Settings) -> tuple[Floats, Any, tuple[float, float]]:
    """Eye, axes, and the tangents of the half angles of view."""
    eye = np.array(camera.position) + head.centre_mm
    path = np.subtract(camera.target, camera.position)
    half = 0.5 * camera.frame_mm / float(np.linalg.norm(path))
    width, height = settings.size
    return eye, frame_of(path, np.array(camera.up)), (half * width / height, half)
