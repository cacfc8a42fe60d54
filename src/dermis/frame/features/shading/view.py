"""The camera as the shading reads it: rays, samples, eyes, and what a picture shows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.features.surface.record import fill_eye
from dermis.frame.projection import (
    Axes,
    Triple,
    Views,
    axes_of,
    between,
    depth_range,
    perspective,
    pixel_samples,
    place_of,
    rows_of,
)
from dermis.frame.technique import ProfileSplit
from dermis.gpu import ComputeProgram, Record
from dermis.mesh.head import Head
from dermis.mesh.mesh import PARTS
from dermis.mesh.outline import Outline
from dermis.scene.camera import Camera, Window
from dermis.scene.settings import Settings
from dermis.scene.skin import MOST_OTHERS

_MOST_MATERIALS = 64
_PARTS = {"all": (1.0, 1.0), "diffuse": (1.0, 0.0), "specular": (0.0, 1.0)}  # from below, off the surface
_RAYS = ("eye", "forward", "right", "up", "shift")


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


def view_record(shade: ComputeProgram, head: Head, settings: Settings, split: ProfileSplit) -> Record:
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


def seen_by(view: Record, pinhole: Pinhole, eyes: EyesSeen | None) -> Record:
    """A shading pass' record with the rays of a camera.

    eyes : of true shape, if it has such
    """
    eye, (right, up, forward), (half, shift) = pinhole
    # Its bytes: numpy's own copy takes the members one by one, and has anything between them.
    record: Record = np.ndarray((), view.dtype, bytearray(view.tobytes()))
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


def rays_of(shader: ComputeProgram, view: Record) -> Record:
    """Return a record of a shader's struct Rays from that of the shading."""
    return shader.record("Rays", **{name: view[name] for name in _RAYS})
