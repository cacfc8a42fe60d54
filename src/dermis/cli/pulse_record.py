"""True pulse at each frame of an animation: a CSV file and a report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from dermis.base.errors import refuse
from dermis.cli.options import Options

if TYPE_CHECKING:
    from dermis.scene.pulse import Pulse


def check_pulse_record(path: Path | None, pulse: Pulse | None) -> None:
    """Raise DermisError if the file of --pulse-record has no pulse to contain, or cannot be written."""
    from dermis.base.atomic_write import check_output

    if path is None:
        return
    if pulse is None:
        refuse("--pulse-record", "--pulse with it", "there is none", "Add --pulse 72, or leave it out")
    if path.exists() and Path(pulse.waveform).exists() and path.samefile(pulse.waveform):
        refuse("--pulse-record", "another file than that of the pulse", f"got {path}", "Choose another name")
    check_output(path, (".csv",))


def pulse_report(pulse: Pulse, frame_numbers: Sequence[int], rate: Fraction) -> Options:
    """Return the settings of a pulse, and its mean rate over the frames [1/min]."""
    begin, end = float(frame_numbers[0] / rate), float(frame_numbers[-1] / rate)
    mean = pulse.signal().mean_rate_per_min(begin, end)
    settings = pulse.model_dump(exclude={"rate_per_min"} if pulse.is_recording else set())
    return {**settings, "mean_rate_per_min": None if math.isnan(mean) else round(mean, 3)}


def write_pulse_record(path: Path, pulse: Pulse, frame_numbers: Sequence[int], rate: Fraction) -> None:
    """Write the true pulse at each frame as a CSV file."""
    from dermis.base.atomic_write import atomic_file

    rows = (pulse.truth_at(float(number / rate)) for number in frame_numbers)
    lines = ["time_s,blood_change,face_up_mm", *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    with atomic_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
