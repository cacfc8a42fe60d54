"""The maps of a head as pbrt's textures."""

from __future__ import annotations

from typing import NamedTuple

from dermis.apps.export.subject import Subject
from dermis.apps.export.targets.openpbr_files import skin_of
from dermis.apps.export.targets.openpbr_look import drawn_maps, encoded_maps
from dermis.apps.export.targets.pbrt_scene import Lines, directive
from dermis.human.head_file import relief_slopes


class Textures(NamedTuple):
    """What a scene needs of maps.

    lines : that make them
    files : by name
    driven : type of parameter, and texture or file, by the skin's parameters
    """

    lines: Lines
    files: dict[str, bytes]
    driven: dict[str, tuple[str, str]]


_FROM = {"colour": ("spectrum", "sRGB", "reflectance"), "roughness": ("float", "linear", "roughness")}


def textures_of(subject: Subject, prefix: str) -> Textures:
    """Of a head; none of a skin by itself.

    prefix : of the files' names
    """
    made = Textures([], {}, {})
    if subject.head is None:
        return made
    found = drawn_maps(subject.head.maps, skin_of(subject), relief_slopes(subject.head))
    if "roughness" in found:
        found["roughness"] = found["roughness"] ** 2  # pbrt takes alpha itself, OpenPBR its root
    for role, data in encoded_maps({role: found[role] for role in found if role != "specular"}).items():
        file = f"{prefix}{role}.png"
        made.files[file] = data
        if role == "normal":
            made.driven["normalmap"] = "string", file
            continue
        kind, encoding, parameter = _FROM[role]
        told = {"string filename": file, "string encoding": encoding, "string wrap": "clamp"}
        made.lines.append(directive(f'Texture "{role}" "{kind}"', "imagemap", told))
        made.driven[parameter] = "texture", role
    return made
