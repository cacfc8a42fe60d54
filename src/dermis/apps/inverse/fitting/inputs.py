"""Inputs of a fit: the photograph in linear light, and the head with its camera."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.errors import format_value, notify, refuse
from dermis.human.person import Human
from dermis.human.skin.painted import PaintedMaps
from dermis.images.colour_spaces import SRGB
from dermis.images.io import EmbeddedPicture, read_colours, repair_radiance
from dermis.mesh.head import Head
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SPECTRAL_PRESET
from dermis.scene.camera import Camera
from dermis.scene.conversions import as_head
from dermis.scene.files import head_table, load_camera, load_scene
from dermis.scene.heads import is_person_name, load_person
from dermis.scene.model import Scene
from dermis.scene.skin import Pigments, Skin

_CLIPPED_LEVEL_FRACTION = 0.985  # fraction of the largest level from which a channel counts as clipped
_MIN_PHOTO_SIDE = 16


@dataclass(frozen=True, eq=False)
class Photograph:
    """Photograph in linear light, at full or reduced size.

    linear : (h, w, 3) values in linear Rec. 709; exposure and white balance are still those of the file
    unclipped : (h, w) fraction of each pixel's area that is opaque and has no clipped channel
    """

    linear: Floats
    unclipped: Floats

    @property
    def size(self) -> tuple[int, int]:
        """Return the width and height of the photograph [pixel]."""
        return self.linear.shape[1], self.linear.shape[0]

    def reduced_to(self, max_side: int) -> Photograph:
        """Return the photograph, reduced if its longer side has more than `max_side` pixels."""
        width, height = self.size
        if max(width, height) <= max_side:
            return self
        scale = max_side / max(width, height)
        size = max(1, round(width * scale)), max(1, round(height * scale))
        unclipped = _area_average(self.unclipped[..., None], size)[..., 0]
        return Photograph(_area_average(self.linear, size), unclipped)


def read_photograph(source: str | Path | EmbeddedPicture | ArrayLike) -> Photograph:
    """Read a photograph from a file or an array, and convert it to linear light.

    source : file, which is turned upright by its EXIF data and converted by its colour profile; or an array
        (h, w, 3) of integers in sRGB or of floats in linear Rec. 709

    Raises DermisError if the source is not a picture.
    """
    name: object = "photo"
    space = SRGB
    if isinstance(source, str | Path | EmbeddedPicture):
        name = source
        image, space = read_colours(source, apply_exif_orientation=True)
    else:
        image = np.asarray(source)
    if image.ndim != 3 or image.shape[2] not in (1, 3, 4) or min(image.shape[:2]) < _MIN_PHOTO_SIDE:
        expected = f"a picture (h, w, 3) of at least {_MIN_PHOTO_SIDE} pixels a side"
        refuse(name, expected, f"got shape {image.shape}", "Save it as RGB")
    if image.dtype.kind != "f" and image.dtype not in (np.uint8, np.uint16):
        refuse(name, "sRGB bytes or linear floats", f"got {image.dtype}", "Convert it")
    is_linear = image.dtype.kind == "f"
    full = 1.0 if is_linear else float(np.iinfo(image.dtype.str).max)
    usable = np.ones(image.shape[:2], bool)
    if image.shape[2] == 4 and (opaque := image[..., 3] >= full).any() and not opaque.all():
        notify(f"{name}: its {int((~opaque).sum()):,} transparent pixels are not fitted")
        usable = opaque
    colours = image[..., :3]
    if is_linear:
        colours = repair_radiance(name, np.asarray(colours, np.float32))
    else:
        usable &= colours.max(axis=2) < _CLIPPED_LEVEL_FRACTION * full
    return Photograph(space.to_linear(colours).astype(np.float64), usable.astype(np.float64))


def _area_average(picture: Floats, new_size: tuple[int, int]) -> Floats:
    """Return a picture (h, w, c) downsampled to means over the area that each new pixel covers.

    new_size : width and height of the result [pixel]
    """
    for axis, count in ((0, new_size[1]), (1, new_size[0])):
        sums = np.cumsum(picture, axis=axis)
        sums = np.concatenate([np.zeros_like(np.take(sums, [0], axis)), sums], axis=axis)
        edges = np.linspace(0.0, picture.shape[axis], count + 1)
        index = np.minimum(edges.astype(int), picture.shape[axis] - 1)
        fraction = (edges - index).reshape([-1 if k == axis else 1 for k in range(3)])
        cumulative = np.take(sums, index, axis) + fraction * np.take(picture, index, axis)
        picture = np.diff(cumulative, axis=axis) * (count / picture.shape[axis])
    return picture


_POSITION_TOLERANCE_MM = 0.01


@dataclass(frozen=True)
class FitSubject:
    """Head in a photograph, with its camera, as a scene without light.

    scene : head, camera, pose and surface
    person : parametric person whose skin maps are painted from pigments; None for other heads
    table : table [head] of the scene file in which the result is saved; empty if the head has neither a name
        nor a file, and the result therefore cannot be saved
    known : names of the skin parameters whose values the scene states; all other values are assumed
    """

    scene: Scene
    person: Human | None
    table: Mapping[str, object]
    known: tuple[str, ...] = ()


def fit_subject(head_or_scene: object, camera: object = None) -> FitSubject:
    """Return the head, camera and pose to fit, from a scene, a head or a person.

    head_or_scene : a scene or its file (.toml), a head or anything that `load_head` accepts, or a `Human`
    camera : a camera, or the name of a preset or of a file; None for the camera of the scene

    Raises DermisError when either argument has another type.
    """
    table: Mapping[str, object] = {}
    if isinstance(head_or_scene, str | os.PathLike) and Path(head_or_scene).suffix.lower() == ".toml":
        table = head_table(Path(head_or_scene))
        scene = load_scene(Path(head_or_scene))[0]
    else:
        scene = head_or_scene if isinstance(head_or_scene, Scene) else Scene(as_head(head_or_scene))
    if camera is not None:
        scene = replace(scene, camera=_resolve_camera(camera, scene.head))  # type: ignore[arg-type]
    person = head_or_scene if isinstance(head_or_scene, Human) else _person_of_head(scene.head)
    name = scene.head.name
    if not table and (person is not None or not is_person_name(name)):
        table = {"name": str(Path(name).resolve()) if Path(name).is_file() else name}
    known = () if scene.skin.pigments is None else tuple(scene.skin.pigments.overrides())
    return FitSubject(_scene_without_lights(scene), person, table, known)


def _resolve_camera(camera_source: object, head: Head) -> Camera | Callable[[Head], Camera]:
    if isinstance(camera_source, str | os.PathLike):
        return load_camera(str(camera_source), head)
    if not (isinstance(camera_source, Camera) or callable(camera_source)):
        actual = f"got {format_value(camera_source)}"
        refuse("camera", "a camera, a preset or a file", actual, 'Write camera="portrait", or camera.toml')
    return camera_source


def _person_of_head(head: Head) -> Human | None:
    """Return the parametric person from which a head and its skin maps were made, or None for other heads."""
    maps = head.maps
    if not isinstance(maps, PaintedMaps) or maps.colour is not None or not is_person_name(head.name):
        return None
    person = replace(load_person(head.name), skin=maps.look)
    a, b = person.positions_mm, head.control_rig.positions_mm
    same = a.shape == b.shape and np.allclose(a, b, atol=_POSITION_TOLERANCE_MM)
    return person if same else None


def _scene_without_lights(scene: Scene) -> Scene:
    """Return the scene without lights, and with explicit values of the skin parameters that are not fitted.

    These are epidermal thickness, eumelanin and oxygen. Each gets the value in the scene's skin; if it has
    none there, the value with which the head's skin maps were painted; for other heads, a default.
    """
    fixed_pigments = {name: getattr(DEFAULT_SKIN, name) for name in ("epidermis_mm", "eumelanin", "oxygen")}
    if isinstance(scene.head.maps, PaintedMaps):
        look = scene.head.maps.look
        fixed_pigments |= {name: getattr(look, name) for name in fixed_pigments}
    if scene.skin.pigments is not None:
        fixed_pigments |= scene.skin.pigments.overrides()
    fixed = {"profile": SPECTRAL_PRESET, "pigments": Pigments(**fixed_pigments)}
    return replace(scene, lights=(), environment=None, skin=Skin(**(scene.skin.model_dump() | fixed)))
