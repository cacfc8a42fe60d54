"""--eye, and what is said of eyes that could not be fitted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from dermis.base.console import note
from dermis.mesh.eye_look import LIMITS

if TYPE_CHECKING:
    from dermis.mesh.head import Head

EYE = "--eye"
_LEAST, _MOST = LIMITS["pupil_mm"]
EyeLooks = Annotated[
    list[str] | None,
    Parameter(
        name=EYE,
        negative="",
        metavar="NAME=NUMBER,...",
        help="What the eyes look like, as eumelanin=0.1,pupil_mm=2.5: eumelanin of the iris, 0 (blue) to 1; "
        f"pupil_mm, its radius, {_LEAST:g} to {_MOST:g}; redness of the white, 0 to 1; seed.",
    ),
]


def note_eyes(head: Head, wanted: str | None) -> None:
    """A line on stderr about a file's eyes that stay plain although their names, or who typed, want more.

    wanted : what was typed for --eyes
    """
    if head.note:
        note(f"note: {head.note}")
    elif wanted == "fitted" and head.eyes is None:
        note("note: eyes: none found by name; --eye-groups names the groups that hold eyeballs")
