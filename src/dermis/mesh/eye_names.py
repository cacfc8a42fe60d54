"""Which groups of a file are eyeballs, by their names."""

from __future__ import annotations

import re
from collections.abc import Sequence

_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_PART = "eyes?|eyeballs?|sclerae?|corneas?|iris|irises|pupils?"
_EYE = re.compile(rf"(?:l|r|left|right)?(?:{_PART})(?:l|r|left|right)?", re.IGNORECASE)
_OTHER = re.compile(
    "(?:(?:eye)?(?:lash|brow|lid|socket|shadow|wear|glass|patch|liner|duct)(?:e?s)?|occlusion|tear|tears"
    "|tearline|hairs?|skin|caruncle)",
    re.IGNORECASE,
)


def names_eye(names: Sequence[str]) -> bool:
    """Whether a group is an eyeball or a part of one: eye, Eye_L, LeftEyeball, sclera, Std_Cornea_R.

    names : of the group, its material's first, which decides where it says either

    Lashes, brows, lids, and films of tears and shadows that lie on the eye are none.
    """
    for name in names:
        words = _WORD.findall(name)
        if any(_OTHER.fullmatch(word) for word in words):
            return False
        if any(_EYE.fullmatch(word) for word in words):
            return True
    return False
