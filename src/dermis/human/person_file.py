"""People as small files: all the numbers that one is made from, as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

from dermis.errors import refuse
from dermis.human.hair.look import HairLook
from dermis.human.person import Human
from dermis.human.skin.look import SkinLook
from dermis.mesh.eyes import EyeLook
from dermis.outputs import replacing

_LARGEST = 1 << 20  # bytes
T = TypeVar("T", Human, SkinLook, EyeLook, HairLook)


def numbers_of(person: Human) -> dict[str, Any]:
    """All that a person is made from, by name; skin, eyes and hair too that only usually go with it."""
    found = {one.name: getattr(person, one.name) for one in fields(person)}
    found |= {"targets": dict(person.targets), "skin": asdict(person.look)}
    return found | {"eyes": asdict(person.iris), "hair": asdict(person.hairdo)}


def write_numbers(path: Path, person: Human) -> int:
    """Write a person as JSON, whole or not at all; its length [byte]."""
    data = (json.dumps({"person": numbers_of(person)}, indent=2, default=float) + "\n").encode()
    with replacing(path) as trial:
        trial.write_bytes(data)
    return len(data)


def read_person(path: Path) -> Human:
    """The person of a file as `write_numbers` makes it; what it leaves out is as usual.

    Raises DermisError for files that are none, and for numbers that cannot be.
    """
    expected = 'JSON with the numbers of a person under "person"'
    try:
        if path.stat().st_size > _LARGEST:
            refuse(
                path, expected, "it is larger than a megabyte", "Write one with dermis head -o person.json"
            )
        told = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as fault:
        refuse(path, expected, f"it cannot be read ({str(fault)[:80]})", "Write one with dermis head")
    person = told.get("person") if isinstance(told, dict) else None
    if not isinstance(person, dict):
        refuse(path, expected, "there is none", "Write one with dermis head -o person.json")
    parts: tuple[tuple[str, Any], ...] = (("skin", SkinLook), ("eyes", EyeLook), ("hair", HairLook))
    made = {name: _made(path, kind, person[name]) for name, kind in parts if person.get(name) is not None}
    return _made(path, Human, person | made)


def _made(path: Path, kind: type[T], numbers: Any) -> T:
    """A dataclass of plain numbers."""
    known = [one.name for one in fields(kind)]
    if not isinstance(numbers, Mapping):
        refuse(path, f"numbers of {', '.join(known)}", f"{numbers!r:.40} came", "Correct it there")
    for name in numbers:
        if name not in known:
            refuse(path, f"names of {', '.join(known)}", f"{name!r:.40} came", "Correct it there")
    try:
        return kind(**numbers)
    except (TypeError, ValueError, AttributeError, OverflowError) as fault:
        refuse(path, "plain numbers", f"one is none ({str(fault)[:80]})", "Correct it there")
