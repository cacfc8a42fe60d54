"""A scene of ours as a scene of Mitsuba's: the same head, lights, camera and pixels."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import numpy as np

from dermis.errors import refuse
from dermis.optics.media import Medium
from dermis.reference.described import surroundings
from dermis.reference.lights import emitter
from dermis.reference.mitsuba_skin import Lambertian, head_shapes, mask_shapes
from dermis.scene.camera import Camera
from dermis.scene.model import Scene

ROULETTE_DEPTH = 100
"""Scatterings before a path may be ended by chance. Ended sooner, the few that live on carry much: on skin2
red has then nearly twice the variance in the same time, and with few samples its mean is 1 % low."""
_DIRECT_DEPTH = 2


def load_mitsuba() -> Any:
    """The module `mitsuba`, without a variant set; DermisError when it is not installed."""
    try:
        return import_module("mitsuba")
    except ImportError as fault:
        remedy = "Install it with: pip install dermis[truth]"
        refuse("path tracing", "the package mitsuba", f"it cannot be imported ({fault})", remedy)


@contextmanager
def variant_of(mi: Any, name: str) -> Iterator[None]:
    """A variant of Mitsuba, until the caller's own is set again; there may have been none."""
    before = mi.variant()
    mi.set_variant(name)
    try:
        yield
    finally:
        if before is not None:
            mi.set_variant(before)


def radiance_scene(mi: Any, scene: Scene, medium: Medium | Lambertian, size: tuple[int, int]) -> Any:
    """Mitsuba's scene, and notes on how the head became bodies of media."""
    head = head_shapes(mi, scene.head, medium)
    direct = {"max_depth": _DIRECT_DEPTH} if isinstance(medium, Lambertian) else {}
    # Spectral MIS: extinction differs between the channels, and sampling one of them makes the others noisy.
    integrator = {"type": "volpathmis", "rr_depth": ROULETTE_DEPTH, "hide_emitters": True, **direct}
    lights = {f"light_{k}": emitter(mi, light, k) for k, light in enumerate(scene.lights, start=1)}
    if scene.environment is not None:
        lights["environment"] = surroundings(mi, scene.environment)
    everything = {
        "type": "scene",
        "integrator": integrator,
        "sensor": _sensor(mi, scene.camera, size),
        **head.shapes,
        **lights,
    }
    return mi.load_dict(everything), head.notes


def mask_scene(mi: Any, scene: Scene, size: tuple[int, int]) -> Any:
    """Mitsuba's scene whose image is the share of each pixel that skin fills."""
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 1},
            "sensor": _sensor(mi, scene.camera, size, sampler="multijitter"),
            **mask_shapes(mi, scene.head),
        }
    )


def _sensor(mi: Any, camera: Camera, size: tuple[int, int], sampler: str = "independent") -> dict[str, Any]:
    width, height = size
    distance = float(np.linalg.norm(np.subtract(camera.target, camera.position)))
    view = ([float(c) for c in v] for v in (camera.position, camera.target, camera.up))
    film = {"width": width, "height": height, "pixel_format": "rgb", "component_format": "float32"}
    return {
        "type": "perspective",
        "fov_axis": "y",
        "fov": float(2.0 * np.degrees(np.arctan(0.5 * camera.frame_mm / distance))),
        "to_world": mi.ScalarTransform4f().look_at(*view),
        "near_clip": 0.5,
        "far_clip": 1e7,
        "film": {"type": "hdrfilm", "rfilter": {"type": "box"}, **film},
        "sampler": {"type": sampler},
    }
