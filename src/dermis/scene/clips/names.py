"""Which morph targets of a head a file's names mean."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_SIDES = {"l": "left", "r": "right"}


def matched(names: Iterable[str], targets: Sequence[str]) -> dict[str, str]:
    """By name the target of the head that it means; names that the head lacks are not there.

    EyeBlinkLeft, eyeBlink_L and blendShape1.eye_blink_left mean eyeBlinkLeft; a name in the same letters
    goes first.
    """
    exact, folded, plain = (
        {key(one): one for one in reversed(targets)} for key in (str, str.casefold, _plain)
    )
    found: dict[str, str] = {}
    for name in names:
        target = exact.get(name) or folded.get(name.casefold()) or plain.get(_plain(name))
        if target is not None and target not in found.values():
            found[name] = target
    return found


def _plain(name: str) -> str:
    """A name without what it belongs to, in small letters, sides in full."""
    last = name.rpartition(".")[2]
    side = re.fullmatch(r"(.+)[_\-. ]([lrLR])", last)
    whole = f"{side[1]}{_SIDES[side[2].lower()]}" if side else last
    return re.sub(r"[\W_]", "", whole).casefold()
