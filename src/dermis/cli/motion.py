"""The motion that `dermis animate` draws, and the times of its frames."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dermis.base.errors import refuse
from dermis.base.quantities import number

if TYPE_CHECKING:
    from dermis.mesh.clip import Clip
    from dermis.mesh.head import Head

_USUAL_RATE = 30.0


@dataclass(frozen=True)
class Span:
    """From when to when frames are wanted, and how many a second; None where nothing was said.

    begin, end : seconds of the motion
    own_rate : of the motion itself, where it does not tell [1/s]
    """

    begin: Fraction | None
    end: Fraction | None
    rate: Fraction | None
    own_rate: float | None

    def frames(self, clip: Clip) -> tuple[range, Fraction]:
        """Numbers of the frames, of which number k lies at k / rate, and the rate [1/s].

        Raises DermisError when the motion ends before the frames begin.
        """
        from dermis.images.movie import exact_rate

        rate = self.rate or exact_rate(clip.rate or _USUAL_RATE)
        first = math.ceil((self.begin or 0) * rate)
        count = clip.frame_count(float(rate))
        beyond = count if self.end is None else min(count, math.ceil(self.end * rate))
        if first >= count:
            came = f"{clip.name} lasts {clip.duration_s:.3f} s"
            refuse("--from", "a time at which there is motion", came, "Choose an earlier one")
        if first >= beyond:
            came = f"at {float(rate):g} frames a second there is none"
            refuse("--to", "at least one frame before it", came, "Choose a later time")
        return range(first, beyond), rate


def parse_span(begin: float | None, end: float | None, fps: str | None, own_rate: float | None) -> Span:
    """The span that was typed."""
    from dermis.images.movie import exact_rate
    from dermis.mesh.clip import LONGEST_S, check_rate

    for option, seconds in (("--from", begin), ("--to", end)):
        if seconds is not None:
            number(option, seconds, 0.0, LONGEST_S, "s")
    if end is not None and end <= (begin or 0):
        refuse("--to", f"a time after --from ({begin or 0:g} s)", f"{end:g} s came", "Correct one of them")
    if own_rate is not None:
        check_rate("--motion-fps", own_rate)
    # as written: the float nearest to 0.1 lies after frame 3 of 30
    exact = [None if seconds is None else Fraction(str(seconds)) for seconds in (begin, end)]
    return Span(exact[0], exact[1], None if fps is None else exact_rate(fps, "--fps"), own_rate)


def motion_file(name: str, motion: str | None) -> str:
    """The file that was named, else the head's own where that can hold clips."""
    from dermis.formats.parts import is_gltf

    if motion is not None:
        return motion
    own = str(_table(name).get("name", name))
    if not is_gltf(own):
        remedy = "Add --motion with a .glb, .csv or .jsonl, or a sequence of .obj"
        refuse("--motion", "a file", f"none came, and {own} has no clips of its own", remedy)
    return own


def clip_of(
    name: str, head: Head, motion: str, clip: str | None, given: Mapping[str, Any], span: Span
) -> Clip:
    """The motion of a file for a head.

    name : of the head as it was typed
    given : fields of its [head] that were typed, of which unit_mm and up hold for a sequence too
    """
    from dermis.formats.motion.sequence import is_sequence
    from dermis.scene.motion import load_motion

    rate = span.own_rate
    if rate is None and span.rate and is_sequence(Path(motion)):  # a file for each frame
        rate = float(span.rate)
    table = {key: value for key, value in {**_table(name), **given}.items() if key in ("unit_mm", "up")}
    return load_motion(motion, head, clip=clip, fps=rate, **table)


def names_of(name: str, head: Head) -> dict[str, tuple[str, ...]]:
    """What can move a head: names of its morph targets and bones, and of the clips in its file."""
    from dermis.formats.gltf.animations import clip_names
    from dermis.formats.parts import is_gltf

    own = Path(str(_table(name).get("name", name)))
    clips = clip_names(own) if is_gltf(own) else ()
    return {"targets": head.targets, "bones": head.bones, "clips": clips}


def _table(name: str) -> dict[str, Any]:
    """The [head] of a scene's file; empty for other heads."""
    from dermis.scene.files import head_table

    return head_table(Path(name)) if Path(name).suffix.lower() == ".toml" else {}
