"""Command line options of living skin: states such as a blush, and the pulse."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from dermis.base.errors import refuse
from dermis.cli.options import Options, check_fields, model_options, option_name
from dermis.scene.pulse import Pulse

STATE_OPTION, PULSE_OPTION = "--state", "--pulse"
StatesOption = Annotated[
    list[str] | None,
    Parameter(
        name=STATE_OPTION,
        negative="",
        metavar="NAME=WEIGHT,...",
        help="State of the skin of a person, such as blush=0.6: blush, pallor, cold, exertion or crying, 0 "
        "to 1; in animations, blush=0.6@2 rises from 2 s on and blush=0.6@2-8 falls from 8 s on. Repeatable.",
    ),
]
_PULSE_OPTION_NAMES = {
    "amplitude": "pulse_amplitude",
    "variability_ms": "pulse_variability",
    "respiration_per_min": "respiration",
    "head_motion_mm": "pulse_head_motion",
    "waveform": "pulse_waveform",
    "seed": "pulse_seed",
}
_EVENT_PATTERN = re.compile(
    r"(?P<name>[\w ]+)=(?P<weight>[^@=]+)(?:@(?P<begin>[^-@]+)(?:-(?P<end>[^-@]+))?)?"
)

if TYPE_CHECKING:
    from dermis.scene.living import StateEvent

    PulseOptions = Options
else:
    PulseOptions = model_options(
        Pulse, only_fields=tuple(_PULSE_OPTION_NAMES), option_names=_PULSE_OPTION_NAMES
    )


def parse_states(option_values: Sequence[str]) -> list[StateEvent]:
    """Return the causes of states that values of --state describe, such as "blush=0.6@2-8,cold=1".

    Raises DermisError for values in another form, unknown states and numbers out of range.
    """
    return [_parse_state(part.strip()) for text in option_values for part in text.split(",")]


def _parse_state(item: str) -> StateEvent:
    from dermis.human.living.zones import check_state_weights
    from dermis.scene.living import StateEvent

    found = _EVENT_PATTERN.fullmatch(item)
    try:
        if found is None:
            raise ValueError
        times = {f"{key}_s": float(found[key]) for key in ("begin", "end") if found[key] is not None}
        weight = float(found["weight"])
    except ValueError:
        expected = "NAME=WEIGHT or NAME=WEIGHT@BEGIN-END with times in s, such as blush=0.6@2-8"
        refuse(STATE_OPTION, expected, f"got {item!r}", "Correct it")
    name = found["name"].strip()
    check_state_weights({name: weight}, STATE_OPTION)
    if times.get("begin_s", 0.0) >= times.get("end_s", math.inf):
        refuse(STATE_OPTION, "a begin before the end", f"got {item!r}", "Correct it")
    return StateEvent(name, weight, **times)


def check_constant_states(events: Iterable[StateEvent]) -> dict[str, float]:
    """Return the weights of states without times; raise DermisError for states with times."""
    weights: dict[str, float] = {}
    for event in events:
        if not event.is_constant:
            actual, advice = f"{event.name} has a time", "Leave out what follows the sign @, or use animate"
            refuse(STATE_OPTION, "states without times in a picture", actual, advice)
        weights[event.name] = event.weight
    return weights


def parse_pulse(pulse: str | None, options: Options) -> Pulse | None:
    """Return the pulse of --pulse and of the options that belong to it; None without --pulse.

    pulse : heart rate [1/min], or a CSV file with a recording

    Raises DermisError for invalid values, and for options of the pulse without --pulse.
    """
    if pulse is None:
        if options:
            option = option_name(next(iter(options)), _PULSE_OPTION_NAMES)
            refuse(option, f"{PULSE_OPTION} with it", "there is none", "Add --pulse 72, or leave it out")
        return None
    names = {**_PULSE_OPTION_NAMES, "rate_per_min": "pulse", "waveform": "pulse_waveform"}
    try:
        values: Options = {"rate_per_min": float(pulse)}
    except ValueError:
        if not Path(pulse).suffix:
            expected = "a heart rate [1/min], or a CSV file with the columns time and value"
            refuse(PULSE_OPTION, expected, f"got {pulse!r}", "Write --pulse 72")
        if "waveform" in options:
            actual = "it is given beside a recording"
            refuse("--pulse-waveform", "a heart rate in --pulse", actual, "Write --pulse 72, or leave it out")
        values = {"waveform": pulse}
    found = check_fields(Pulse, {**values, **options}, names)
    if "waveform" in values and not found.is_recording:
        actual = f"{pulse} has one column, the form of a beat"
        refuse(
            PULSE_OPTION,
            "a recording with the columns time and value",
            actual,
            "Write --pulse 72 --pulse-waveform FILE",
        )
    return found
