"""What a frame reads, made from a scene: records for the shaders, matrices, and space for the results."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.frame.atlas_layout import Layout
from dermis.frame.geometry import HeadTextures
from dermis.frame.levels import Levels
from dermis.frame.passes.bloom import Glow
from dermis.frame.passes.post import Picture
from dermis.frame.passes.screen_space import ScreenSpread
from dermis.frame.passes.shadows import ShadowMaps
from dermis.frame.passes.variants import Constants
from dermis.frame.passes.visibility_buffer import Layers
from dermis.frame.pre_integrated import PreIntegrated
from dermis.frame.projection import (
    Axes,
    Triple,
    Views,
    axes_of,
    between,
    depth_range,
    perspective,
    place_of,
    rows_of,
)
from dermis.frame.samples import pixel_samples
from dermis.gpu import ComputeProgram
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.optics.fits.gaussian import single_gaussian
from dermis.optics.gaussians import GaussianSum
from dermis.scene.camera import Camera
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
# A Gaussian narrower than this is finer than texels and pores: it is lit again, not blurred.
_RELIT_MM2 = 0.1**2
_MOST_MATERIALS = 64
_PARTS = {"all": (1.0, 1.0), "diffuse": (1.0, 0.0), "specular": (0.0, 1.0)}  # from below, off the surface
WITHOUT_ATLAS = ("none", "screen-space", "pre-integrated")
"""Techniques that do not spread light over the atlas."""


@dataclass(frozen=True)
class Standing:
    """What a frame reads that cameras and lights leave as it is.

    layouts : atlases that light is spread on; the first is the one that is looked at
    scatters : whether light spreads below the surface
    blurred_mm2, level_weight : variances and weights of the blurred levels
    edge, clear : what blurs find beyond a chart's edge, and the light of empty texels
    scattered : texture of the light that leaves below the surface
    view, constants : record of the shading pass, and the values of its `override`s
    suns : lights that the environment adds
    gaussians : terms of the profile
    spread : how light spreads over the picture, None when it does not
    glow : space for the bloom, None without one
    """

    head: HeadTextures
    layouts: list[Layout]
    shadow_maps: ShadowMaps
    scatters: bool
    levels: Levels
    blurred_mm2: Floats
    level_weight: Floats
    edge: str
    clear: Floats
    scattered: Any
    seen: Layers
    view: Any
    constants: Constants
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
class Inputs(Standing):
    """Everything `draw_frame` touches.

    shadow_views, shadow_key : how the shadow maps see the head, and what they would show
    camera : how the picture's samples see it
    scale : what light is multiplied with in the blurred levels
    light_constants : values of the irradiance pass' `override`s
    """

    shadow_views: Views
    shadow_key: bytes
    scale: float
    camera: Views
    light_constants: Constants


class Pinhole(NamedTuple):
    """Where a camera is and what it sees.

    axes : right, up and forward
    half : tangents of the half angles of view, across and up
    """

    eye: Triple
    axes: Axes
    half: tuple[float, float]


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


def pinhole(camera: Camera, head: Head, settings: Settings) -> Pinhole:
    """The camera as the renderer takes it."""
    eye, path = place_of(camera.position, head.centre_mm), between(camera.position, camera.target)
    half = 0.5 * camera.frame_mm / math.hypot(*path)
    width, height = settings.size
    return Pinhole(eye, axes_of(path, camera.up), (half * width / height, half))


def camera_views(pinhole: Pinhole, mesh: Mesh, samples: int) -> Views:
    """What the camera sees at each sample of the pixel."""
    rows = rows_of(pinhole.eye, pinhole.axes)
    clip = perspective(rows, pinhole.half, *depth_range(mesh, rows))
    return Views(np.array([clip]), pixel_samples(samples))


def view_record(
    shade: ComputeProgram, head: Head, settings: Settings, split: Split, pre: PreIntegrated | None = None
) -> Any:
    """The shading pass' record without the camera: samples and weights.

    pre : tables of pre-integrated skin and their scales
    """
    jitter = np.zeros((64, 4), np.float32)
    jitter[: settings.samples, :2] = pixel_samples(settings.samples)
    colours = np.zeros((_MOST_MATERIALS, 4), np.float32)
    materials = head.mesh.materials
    if len(materials) > _MOST_MATERIALS:
        count = f"it has {len(materials)}"
        refuse(head.name, f"at most {_MOST_MATERIALS} materials", count, "Join some groups")
    for index, material in enumerate(materials):
        colours[index, :3] = material.colour
    record = shade.record(
        "Shade",
        samples=settings.samples,
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


def seen_by(view: Any, pinhole: Pinhole) -> Any:
    """A shading pass' record with the rays of a camera."""
    eye, (right, up, forward), half = pinhole
    # Its own copy would have anything between its members, and keys have it all.
    record: Any = np.ndarray((), view.dtype, bytearray(view.tobytes()))
    record["eye"], record["forward"] = eye, forward
    record["right"], record["up"] = tuple(half[0] * c for c in right), tuple(half[1] * c for c in up)
    return record
