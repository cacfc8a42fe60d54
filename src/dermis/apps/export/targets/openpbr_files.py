"""Looks of a subject's parts, and its maps as files beside a document."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from dermis.apps.export.subject import Subject
from dermis.apps.export.targets.openpbr_look import Look, drawn_maps, encoded_maps, plain_look, skin_look
from dermis.human.head_file import relief_slopes
from dermis.optics.media import Floats
from dermis.scene.skin import Skin

_M = 1e-3
_LONGEST = 40


def place_of(place: Path, subject: Subject, suffix: str) -> tuple[Path, str]:
    """The file that a target writes, and what the names of those beside it begin with.

    place : as `Target.write` gets it
    suffix : of the file in a folder
    """
    file = place if place.suffix else place / f"{subject.identifier}{suffix}"
    plain = re.sub(r"[^A-Za-z0-9]+", "_", file.stem).strip("_")[:_LONGEST]
    return file, f"{plain or subject.identifier}_"


def skin_of(subject: Subject) -> Skin:
    """The subject's own skin, or the default one."""
    return Skin() if subject.scene is None else subject.scene.skin


def write_pictures(subject: Subject, folder: Path, prefix: str) -> dict[str, Path]:
    """The maps of the skin by role; none for a skin by itself."""
    if subject.head is None:
        return {}
    found = drawn_maps(subject.head.maps, skin_of(subject), relief_slopes(subject.head))
    written = {}
    for role, data in encoded_maps(found).items():
        written[role] = folder / f"{prefix}{role}.png"
        written[role].write_bytes(data)
    return written


def looks_of(subject: Subject, mfp_mm: Floats, roles: Iterable[str]) -> dict[int, Look]:
    """Materials by their number in the subject's mesh.

    mfp_mm : (3,) mean free paths of the skin
    roles : of the maps that there are
    """
    red, green, blue = (_M * float(one) for one in mfp_mm)
    colour = tuple(float(min(max(one, 0.0), 1.0)) for one in subject.albedo)
    mesh, known = subject.shape.mesh, list(roles)
    looks = {}
    for kind in sorted(set(mesh.material.tolist())):
        one = mesh.materials[kind]
        if one.kind == "skin":
            looks[kind] = skin_look(one.name, skin_of(subject), (red, green, blue), colour, known)
        else:
            looks[kind] = plain_look(one)
    return looks
