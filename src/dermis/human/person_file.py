"""Files of people: their parameters as JSON, and their heads as glTF."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.build import MIN_ATLAS_SIDE, build_atlas
from dermis.base.atomic_write import atomic_file
from dermis.base.errors import DermisError, error_context, format_value, refuse
from dermis.base.reading import parse_json, read_text
from dermis.formats.gltf.write import encode_head
from dermis.human.hair.look import HairLook
from dermis.human.makehuman import check_targets
from dermis.human.person import Human, worn_items
from dermis.human.skin.look import SkinLook
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import EyeTextures
from dermis.mesh.head import Head

T = TypeVar("T", Human, SkinLook, EyeLook, HairLook)
_STRETCH_ATLAS_SIDE = 1024
"""Largest side of the atlas that gives the size of texels on the skin; this size varies slowly [texel]."""


def person_parameters(person: Human) -> dict[str, Any]:
    """Return all parameters of a person as a dictionary.

    If the look of the skin, hair or eyes is not set, the look that is typical for the person takes its place.
    """
    numbers = {one.name: getattr(person, one.name) for one in fields(person)}
    numbers |= {"targets": dict(person.targets), "skin": asdict(person.look)}
    numbers |= {name: asdict(item) if item else None for name, item in worn_items(person).items()}  # type: ignore[call-overload]
    return numbers | {"eyes": asdict(person.iris), "hair": asdict(person.hair_look)}


def write_person_json(path: Path, person: Human) -> int:
    """Write the parameters of a person as JSON, atomically, and return the file size [byte]."""
    data = (json.dumps({"person": person_parameters(person)}, indent=2, default=float) + "\n").encode()
    with atomic_file(path) as temporary:
        temporary.write_bytes(data)
    return len(data)


def read_person(path: Path) -> Human:
    """Read a person from a JSON file written by `write_person_json`; missing parameters get their defaults.

    Raises DermisError for other files and for invalid values.
    """
    expected = 'JSON with the numbers of a person under "person"'
    document = parse_json(read_text(path, expected), path, expected)
    person = document.get("person") if isinstance(document, dict) else None
    if not isinstance(person, dict):
        refuse(path, expected, "there is none", "Write one with dermis head -o person.json")
    return person_from_fields(path, person)


def person_from_fields(path: Path, person: dict[str, Any]) -> Human:
    """Return the person with parameters as in the result of `person_parameters`.

    path : path of the file that contains them, for error messages

    Raises DermisError for invalid values.
    """
    parts: tuple[tuple[str, Any], ...] = (("skin", SkinLook), ("eyes", EyeLook), ("hair", HairLook))
    looks = {
        name: _build_dataclass(path, kind, person[name])
        for name, kind in parts
        if person.get(name) is not None
    }
    human = _build_dataclass(path, Human, person | looks)
    with error_context(path):
        check_targets(human.targets)
    return human


def _build_dataclass(path: Path, dataclass_type: type[T], field_values: Any) -> T:
    """Return an instance of a dataclass, such as `Human` or `SkinLook`, built from field values in a file.

    path : path of the file, for error messages
    field_values : mapping from field name to value, as read from the file
    """
    known = [one.name for one in fields(dataclass_type)]
    if not isinstance(field_values, Mapping):
        actual = f"got {format_value(field_values)}"
        refuse(path, f"numbers of {', '.join(known)}", actual, "Correct the file")
    for name in field_values:
        if name not in known:
            refuse(path, f"names of {', '.join(known)}", f"got {format_value(name)}", "Correct the file")
    try:
        return dataclass_type(**field_values)
    except DermisError as fault:
        raise DermisError(f"{path}: {fault}") from None


def write_person_glb(
    path: Path,
    person: Human,
    head: Head,
    *,
    roughness: float,
    expression_weights: Mapping[str, float] | None = None,
    eyes: EyeTextures | None = None,
) -> int:
    """Write a person's head as a .glb file, atomically, and return the file size [byte].

    roughness : Beckmann roughness m of skin without a roughness map [-]
    expression_weights : weights of the expression morph targets, stored as default weights in the file
    eyes : colour and normal textures of the eyes; if None, the eyes are exported with one colour
    """
    notes = {"person": person_parameters(person)}
    data = encode_head(
        head,
        roughness=roughness,
        weights=expression_weights,
        slopes=relief_slopes(head),
        asset_extras=notes,
        eyes=eyes,
    )
    with atomic_file(path) as temporary:
        temporary.write_bytes(data)
    return len(data)


def relief_slopes(head: Head) -> NDArray[np.float32] | None:
    """Return the slopes (n, n, 2) of a head's height map, for computing a normal map [-].

    The channels are the slopes to the right and upwards.

    The result is None for heads that have a normal map already, or that have no square height map.
    """
    height = head.maps.height
    if head.maps.normal is not None or height is None:
        return None
    side = len(height)
    if side != height.shape[1] or side < MIN_ATLAS_SIDE:
        return None
    down, right = np.gradient(height)
    coarse = max(MIN_ATLAS_SIDE, min(side, _STRETCH_ATLAS_SIDE))
    stretch = build_atlas(head.mesh, coarse).stretch.astype(np.float32)
    if side > coarse:
        texels = np.arange(side) * coarse // side
        stretch = stretch[texels][:, texels] * np.float32(side / coarse)
    return np.asarray(np.stack([right, -down], axis=-1) * stretch, np.float32)
