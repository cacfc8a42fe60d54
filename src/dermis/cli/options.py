"""Options that are more than a word or a number, and checks that name an option as it was typed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter, Token

from dermis.errors import DermisError, refuse

if TYPE_CHECKING:
    from dermis.scene.plain import Plain


def _whole(_: type, tokens: Sequence[Token]) -> int:
    return int(tokens[0].value)


Json = Annotated[bool, Parameter(name="--json", negative="")]
# cyclopts itself would round 64.5.
Whole = Annotated[int | None, Parameter(converter=_whole)]


def check(kind: type[Plain], given: Mapping[str, Any], names: Mapping[str, str] | None = None) -> None:
    """Refuse values that no field of `kind` can have, under the names of their options.

    given : values by field
    names : options by field, where they differ
    """
    from dermis.scene.plain import ImpossibleError

    try:
        kind(**given)
    except ImpossibleError as error:
        place, finding = next(iter(error.findings.items()))
        field = place.partition(".")[0]
        option = (names or {}).get(field, field).replace("_", "-") or "size"
        raise DermisError(f"--{option}: {finding}. Correct it.") from None


def parse_size(text: str) -> tuple[int, int]:
    """Width and height [pixel] of "1024x1024"."""
    match = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text)
    if not match:
        came, remedy = f"{text!r} came", "Write two whole numbers with an x"
        refuse("--size", "WIDTHxHEIGHT, such as 1024x1024", came, remedy)
    return int(match[1]), int(match[2])


def parse_colour(text: str) -> tuple[float, float, float]:
    """Linear Rec. 709 of "red,green,blue"."""
    try:
        red, green, blue = (float(part) for part in text.split(","))
    except ValueError:
        refuse("--background", "red,green,blue, such as 0,0,0", f"{text!r} came", "Write three numbers")
    return red, green, blue


def parse_lengths(option: str, text: str) -> tuple[float, ...]:
    """Lengths [mm] of "0.5,1,2"."""
    try:
        lengths = tuple(float(part) for part in text.split(","))
    except ValueError:
        refuse(option, "lengths in mm, such as 0.5,1,2", f"{text!r} came", "Write numbers with commas")
    if not all(0.0 < length < 1e6 for length in lengths):
        refuse(option, "lengths above 0 mm", f"{text!r} came", "Correct them")
    return lengths
