"""Choice of the groups of a mesh file that are skin."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from dermis.formats.parts import MaterialGroup, MeshPart
from dermis.mesh.geometry import triangle_areas

_WORD_PATTERN = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
SKIN_WORDS = ("skin", "skins", "epidermis", "flesh")
"""Words in the names of skin groups; if any group has such a word, groups without one are not skin."""
BODY_WORDS = (
    *("face", "head", "body", "torso", "neck", "ear", "ears", "nose", "lip", "lips", "nostril", "nostrils"),
    *("arm", "arms", "hand", "hands", "leg", "legs", "foot", "feet", "limbs", "finger", "fingers", "forearm"),
)
"""Words in the names of skin groups, for files in which no group has one of `SKIN_WORDS`."""
NON_SKIN_WORDS = (
    *("hair", "hairs", "brow", "brows", "eyebrow", "eyebrows", "lash", "lashes", "eyelash", "eyelashes"),
    *("beard", "mustache", "moustache", "scalp", "eye", "eyes", "eyeball", "eyeballs", "iris", "cornea"),
    *("sclera", "pupil", "tear", "tears", "tearline", "occlusion", "highlight", "teeth", "tooth", "tongue"),
    *(
        "gum",
        "gums",
        "mouth",
        "cloth",
        "cloths",
        "clothes",
        "clothing",
        "outfit",
        "shirt",
        "tshirt",
        "jacket",
    ),
    *(
        "coat",
        "dress",
        "skirt",
        "pants",
        "trousers",
        "jeans",
        "shorts",
        "tops",
        "bottoms",
        "underwear",
        "bra",
    ),
    *("shoe", "shoes", "boot", "boots", "sock", "socks", "glove", "gloves", "hat", "cap", "helmet", "hood"),
    *("glasses", "eyewear", "goggles", "mask", "scarf", "collar", "tie", "belt", "armor", "armour", "metal"),
    *("earring", "earrings", "necklace", "jewelry", "jewellery", "nail", "nails", "accessory", "accessories"),
    *("eyeline", "eyeliner", "leather", "moleskin", "sheepskin", "horn", "horns", "background", "plinth"),
)
"""Words in the names of groups that are not skin, unless another word of the name is in `SKIN_WORDS`."""
HEAD_SHARE_OF_FIGURE_HEIGHT = 0.3
"""Top fraction of a mesh's height that counts as the head when its skin is identified by area [-]."""
_MIN_HEAD_AREA_FRACTION = 0.1  # smallest fraction of the head's area that a part covers if it is skin


def choose_skin(
    mesh_parts: Sequence[MeshPart], groups: Sequence[MaterialGroup], is_scattering: Sequence[bool]
) -> list[bool]:
    """Return whether each mesh part is skin.

    The following rules are tried in this order, and the first that selects any part decides. If no rule
    selects a part, all parts are skin.

    1. The file states that light scatters below the surface of the part.
    2. A name of the part contains a word of `SKIN_WORDS`.
    3. A name contains a word of `BODY_WORDS`, and no name contains a word of `NON_SKIN_WORDS`.
    4. The part covers at least a tenth of the head, and no name contains a word of `NON_SKIN_WORDS`.

    groups : for each part, the group that contains its names
    is_scattering : for each part, whether the file states that light scatters below its surface
    """
    words = [_group_words(group) for group in groups]
    is_other = [bool(own & set(NON_SKIN_WORDS)) for own in words]
    named = [_has_skin_word(own) for own in words]
    body = [bool(own & set(BODY_WORDS)) and not other for own, other in zip(words, is_other, strict=True)]
    for rule in (list(is_scattering), named, body):
        if any(rule):
            return rule
    covering = _covers_head(mesh_parts, is_other)
    return covering if any(covering) else [True] * len(mesh_parts)


def _group_words(material_group: MaterialGroup) -> set[str]:
    return {word.casefold() for name in material_group.names for word in _WORD_PATTERN.findall(name)}


def _has_skin_word(name_words: set[str]) -> bool:
    """Return whether any word means skin, either alone or in a compound such as faceskin."""
    own = {word for word in name_words if word.endswith(("skin", "skins")) and word not in NON_SKIN_WORDS}
    return bool(own | (name_words & set(SKIN_WORDS)))


def _covers_head(mesh_parts: Sequence[MeshPart], is_not_skin: Sequence[bool]) -> list[bool]:
    """Return whether each mesh part covers at least a tenth of the head's area.

    is_not_skin : for each part, whether its names show that it is something else, such as hair; the area of
        these parts is not included in the area of the head
    """
    heights = np.concatenate([part.positions[:, 1] for part in mesh_parts])
    lowest = heights.max() - HEAD_SHARE_OF_FIGURE_HEIGHT * np.ptp(heights)
    area = np.zeros(len(mesh_parts))
    for index, part in enumerate(mesh_parts):
        corners = part.positions[part.triangles]
        area[index] = triangle_areas(corners)[corners[..., 1].mean(axis=1) >= lowest].sum()
    area[np.array(is_not_skin)] = 0.0
    return [bool(own >= _MIN_HEAD_AREA_FRACTION * area.sum() > 0.0) for own in area]


def describe_skin_groups(groups: Sequence[MaterialGroup], is_skin: Sequence[bool]) -> str:
    """Return a note that says which groups are skin, and how to choose others; "" if all groups are skin."""
    names = [group.names[0] for group in groups]
    skin = list(dict.fromkeys(name for name, own in zip(names, is_skin, strict=True) if own))
    other = [name for name in dict.fromkeys(names) if name not in skin]
    if not other:
        return ""
    return (
        f"skin is {_join_names(skin)}; not skin: {_join_names(other)}. --skin-groups NAME,... chooses others"
    )


def _join_names(group_names: Sequence[str], max_count: int = 6) -> str:
    shown = ", ".join(repr(name) for name in group_names[:max_count])
    return f"{shown} and {len(group_names) - max_count} more" if len(group_names) > max_count else shown
