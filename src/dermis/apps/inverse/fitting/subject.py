"""Whose photograph it is: a head with what is known of its skin, before a camera."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dermis.base.errors import refuse, shown_value
from dermis.human.person import Human
from dermis.human.skin.painted import PaintedMaps
from dermis.mesh.head import Head
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SPECTRAL
from dermis.scene.camera import Camera
from dermis.scene.files import head_table, load_camera, load_scene
from dermis.scene.given import given_head
from dermis.scene.heads import is_person, person_of
from dermis.scene.model import Scene
from dermis.scene.skin import Pigments, Skin

_SAME_MM = 0.01


@dataclass(frozen=True)
class Subject:
    """A scene without light.

    person : whose skin is painted, None for other heads
    table : [head] of a scene's file for those; empty for people who were given as heads without a name
    """

    scene: Scene
    person: Human | None
    table: dict[str, Any]


def subject_of(given: object, camera: object = None) -> Subject:
    """The head, camera, pose and surface of what is given.

    given : a scene or its file (.toml), a head or what `load_head` takes, or a `Human`
    camera : a camera, a preset's name or a file; the scene's own when left out

    Raises DermisError for anything else.
    """
    table: dict[str, Any] = {}
    if isinstance(given, str | os.PathLike) and Path(given).suffix.lower() == ".toml":
        table = head_table(Path(given))
        scene = load_scene(Path(given))[0]
    else:
        scene = given if isinstance(given, Scene) else Scene(given_head(given))
    if camera is not None:
        scene = replace(scene, camera=_camera(camera, scene.head))
    person = given if isinstance(given, Human) else _person(scene.head)
    name = scene.head.name
    if not table and (person is not None or not is_person(name)):
        table = {"name": str(Path(name).resolve()) if Path(name).is_file() else name}
    return Subject(_plain(scene), person, table)


def _camera(given: object, head: Head) -> Any:
    if isinstance(given, str | os.PathLike):
        return load_camera(str(given), head)
    if not (isinstance(given, Camera) or callable(given)):
        came = f"{shown_value(given)} came"
        refuse("camera", "a camera, a preset or a file", came, 'Write camera="portrait", or camera.toml')
    return given


def _person(head: Head) -> Human | None:
    """The person that a painted head is, with the skin that is painted on it."""
    if not isinstance(head.maps, PaintedMaps) or head.maps.colour is not None or not is_person(head.name):
        return None
    person = replace(person_of(head.name), skin=head.maps.look)
    own, there = person.positions_mm, head.control.positions_mm
    same = own.shape == there.shape and np.allclose(own, there, atol=_SAME_MM)
    return person if same else None


def _plain(scene: Scene) -> Scene:
    """Without light, and with what is held of the skin's pigments."""
    own = {name: getattr(DEFAULT_SKIN, name) for name in ("epidermis_mm", "eumelanin", "oxygen")}
    if isinstance(scene.head.maps, PaintedMaps):
        look = scene.head.maps.look
        own |= {"eumelanin": look.eumelanin, "oxygen": look.oxygen}
    if scene.skin.pigments is not None:
        own |= scene.skin.pigments.given()
    held = {"profile": SPECTRAL, "pigments": Pigments(**own)}
    return replace(scene, lights=(), environment=None, skin=Skin(**(scene.skin.model_dump() | held)))
