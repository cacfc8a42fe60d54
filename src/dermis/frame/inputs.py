"""Everything a frame reads: resources that persist, and what cameras and lights change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.atlas_layout import AtlasLayout
from dermis.frame.curvature import Curvature
from dermis.frame.geometry import HeadResources
from dermis.frame.levels import Blur, Levels, Split
from dermis.frame.passes.background import Backdrop
from dermis.frame.passes.bloom import Glow
from dermis.frame.passes.meter import Meter
from dermis.frame.passes.moving_occlusion import Sky
from dermis.frame.passes.outputs.motion import Before
from dermis.frame.passes.outputs.planes import OutputResources
from dermis.frame.passes.painting.expression import Face
from dermis.frame.passes.post import Picture
from dermis.frame.passes.shadows import ShadowMaps
from dermis.frame.passes.shape import MotionBytes
from dermis.frame.passes.visibility_buffer import Layers
from dermis.frame.profile_mixture import Mixture
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
from dermis.frame.shape import Shape
from dermis.frame.sky import Look
from dermis.frame.strands import StrandResources
from dermis.frame.surface import fill_eye
from dermis.gpu import ComputeProgram, Constants
from dermis.mesh.head import Head
from dermis.mesh.mesh import PARTS
from dermis.mesh.outline import Outline
from dermis.scene.camera import Camera, Window
from dermis.scene.settings import Settings
from dermis.scene.skin import MOST_OTHERS

Floats = NDArray[np.float64]
_MOST_MATERIALS = 64
_PARTS = {"all": (1.0, 1.0), "diffuse": (1.0, 0.0), "specular": (0.0, 1.0)}  # from below, off the surface


@dataclass(frozen=True, eq=False)
class Resources:
    """What cameras and lights leave as it is.

    shape : the head's, which the motion of each frame moves
    person : the shape of another person at rest, None for the head's own
    face : the painted maps as far as expressions change them, None where nothing does
    layouts : atlases that light is spread on; the first is the one that is looked at
    scatters : whether light spreads over them
    blurs : how, on each, where light is as bright as it was given
    mixture : of profiles by a map, None for one profile
    scattered : texture of the light that leaves below the surface
    curvature : the surface's, None where nothing reads it
    own : what the technique made for itself
    view, constants : record of the shading pass without the camera, and its pipeline constants
    suns : lights that the environment adds
    sky : the open sky at the head's vertices, None where occlusion does not follow its shape
    gaussians : terms of the profile
    strands : hairs, None for none
    meter : what meters the exposure, None where it is given
    backdrop : space for what is behind the head, None for nothing
    glow : space for the bloom, None without one
    outputs : space for what is asked besides the picture, None for nothing
    unscattered : share of the skin's triangles that the atlas cannot hold
    """

    shape: Shape
    person: Shape | None
    face: Face | None
    head: HeadResources
    layouts: tuple[AtlasLayout, ...]
    shadow_maps: ShadowMaps
    scatters: bool
    levels: Levels
    blurs: tuple[Blur, ...]
    mixture: Mixture | None
    scattered: Any
    curvature: Curvature | None
    own: Any
    visibility: Layers
    view: Any
    constants: Constants
    suns: int
    sky: Sky | None
    gaussians: int
    strands: StrandResources | None
    picture: Picture
    meter: Meter | None
    backdrop: Backdrop | None
    glow: Glow | None
    outputs: OutputResources | None
    unscattered: float


@dataclass(frozen=True, eq=False)
class Inputs:
    """Everything that a frame reads.

    motion : what moves the head's shape
    movements : what changes the painted face, None where nothing does
    layouts, blurs : those of the resources in the light of now
    shadow_views : how the shadow maps see the head
    light_constants : pipeline constants of what is lit
    camera : how the picture's samples see the head
    seen : what the picture shows of a plane before the eye
    around : how the sky sees the head, and the shader's record of it; None where occlusion does not move
    view, constants : record of the shading pass, and its pipeline constants
    centre_mm : the head's, from which places of the scene are counted
    before : the scene before, None where nothing reads it
    """

    resources: Resources
    settings: Settings
    motion: MotionBytes
    movements: NDArray[np.float32] | None
    layouts: tuple[AtlasLayout, ...]
    blurs: tuple[Blur, ...]
    shadow_views: Views
    light_constants: Constants
    camera: Views
    seen: Window
    around: tuple[Look, Any] | None
    view: Any
    constants: Constants
    centre_mm: Triple
    before: Before | None = None

    @property
    def lit(self) -> dict[str, Any]:
        """Of the layout that is looked at."""
        return self.layouts[0].lit


class Pinhole(NamedTuple):
    """Where a camera is and what it sees.

    axes : right, up and forward
    window : of a plane before the eye
    """

    eye: Triple
    axes: Axes
    window: Window


class EyesSeen(NamedTuple):
    """How eyes of true shape stand in a motion.

    frames : (2, 4, 4) from the head's space to each eye's
    edges_mm : (2, r, 3) the edges of the lids around each; between two, a point of a smooth curve is put;
        None where they are unknown, as in files
    """

    frames: NDArray[np.float64]
    edges_mm: NDArray[np.float64] | None


def pinhole(camera: Camera, head: Head, settings: Settings) -> Pinhole:
    """The camera as the renderer takes it."""
    eye, path = place_of(camera.position, head.centre_mm), between(camera.position, camera.target)
    width, height = settings.size
    return Pinhole(eye, axes_of(path, camera.up), camera.window(width / height))


def camera_views(pinhole: Pinhole, outline: Outline, samples: int) -> Views:
    """What the camera sees at each sample of the pixel."""
    rows = rows_of(pinhole.eye, pinhole.axes)
    clip = perspective(rows, pinhole.window, *depth_range(outline, rows))
    return Views(np.array([clip]), pixel_samples(samples))


def view_record(shade: ComputeProgram, head: Head, settings: Settings, split: Split) -> Any:
    """The shading pass' record without the camera: samples and weights."""
    jitter = np.zeros((64, 4), np.float32)
    jitter[: settings.samples, :2] = pixel_samples(settings.samples)
    colours = np.zeros((_MOST_MATERIALS, 4), np.float32)
    materials = head.mesh.materials
    if len(materials) > _MOST_MATERIALS:
        count = f"it has {len(materials)}"
        refuse(head.name, f"at most {_MOST_MATERIALS} materials", count, "Join some groups")
    for index, material in enumerate(materials):
        colours[index, :3] = material.colour
        colours[index, 3] = 1 + PARTS.index(material.part) if material.part else 0
    record = shade.record(
        "Shade",
        samples=settings.samples,
        relit=split.relit,
        relit_changes=np.pad(split.relit_changes, ((0, MOST_OTHERS - len(split.others)), (0, 1))),
        total=split.total,
        shown=_PARTS[settings.parts],
        material_colour=colours,
        jitter=jitter,
    )
    for name, value in split.fine.items():
        record["fine"][name] = value
    if head.eyes is not None:
        fill_eye(record["eyes"], head.eyes.look)
        record["eyes"]["material"] = head.eyes.material
        record["eyes"]["middle_mm"] = head.eyes.middle_mm
    return record


def seen_by(view: Any, pinhole: Pinhole, eyes: EyesSeen | None) -> Any:
    """A shading pass' record with the rays of a camera.

    eyes : of true shape, if it has such
    """
    eye, (right, up, forward), (half, shift) = pinhole
    # Its bytes: numpy's own copy takes the members one by one, and has anything between them.
    record: Any = np.ndarray((), view.dtype, bytearray(view.tobytes()))
    record["eye"], record["forward"] = eye, forward
    record["right"], record["up"] = tuple(half[0] * c for c in right), tuple(half[1] * c for c in up)
    record["shift"] = shift
    if eyes is not None:
        record["eyes"]["to_own"] = eyes.frames.transpose(0, 2, 1)  # by columns
    if eyes is not None and eyes.edges_mm is not None:
        edges = eyes.edges_mm
        a, b, c = (np.roll(edges, -k, axis=1) for k in (-1, 1, 2))
        both = np.stack([edges, (9.0 * (edges + b) - a - c) / 16.0], axis=2).reshape(2, -1, 3)
        whole = np.concatenate([both, np.ones((*both.shape[:2], 1))], axis=-1)
        record["lids"] = np.einsum("kij,krj->kri", eyes.frames, whole).reshape(-1, 4)
    return record
