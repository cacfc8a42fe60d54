"""Command-line options for living skin: states such as a blush, and the pulse."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from dermis.base.errors import refuse
from dermis.cli.options import Options, check_fields, model_options, option_name
from dermis.human.living import TYPICAL_BEAT
from dermis.scene.pulse import FIELDS_OF_MODEL, Pulse

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
    """Return the events that values of --state such as "blush=0.6@2-8,cold=1" describe.

    Raises DermisError for invalid syntax, unknown states and numbers out of range.
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
    if not times.get("begin_s", -math.inf) < times.get("end_s", math.inf):
        refuse(STATE_OPTION, "a begin before the end", f"got {item!r}", "Correct it")
    return StateEvent(name, weight, **times)


def check_constant_states(events: Iterable[StateEvent]) -> dict[str, float]:
    """Return the weights of states without times; weights of the same state add up, to at most 1.

    Raises DermisError for states with times.
    """
    from dermis.scene.living import StateEvent

    constant = list(events)
    for event in constant:
        if not event.is_constant:
            actual, advice = (
                f"{event.name} has times",
                "Remove @ and the times after it, or use dermis animate",
            )
            refuse(STATE_OPTION, "states without times, except in animations", actual, advice)
    return StateEvent.weights_at(constant, 0.0)


def parse_pulse(pulse: str | None, options: Options) -> Pulse | None:
    """Return the pulse that --pulse and its further options describe; None without --pulse.

    pulse : heart rate [1/min], or a CSV file with a recording

    Raises DermisError for invalid values, and for options of the pulse without --pulse.
    """
    if pulse is None:
        if options:
            actual, advice = "there is none", f"Add {PULSE_OPTION} 72, or leave it out"
            refuse(_option(next(iter(options))), f"{PULSE_OPTION} with it", actual, advice)
        return None
    try:
        rate = float(pulse)
    except ValueError:
        return _parse_recording(pulse, options)
    waveform = str(options.get("waveform", TYPICAL_BEAT))
    if Pulse(waveform=waveform).is_recording:
        actual = f"{waveform} has two, as a recording"
        advice = f"Write {PULSE_OPTION} {waveform}"
        refuse(_option("waveform"), "a file with one column, the values of one beat", actual, advice)
    return check_fields(
        Pulse, {**options, "rate_per_min": rate}, _PULSE_OPTION_NAMES | {"rate_per_min": "pulse"}
    )


def _parse_recording(file_name: str, options: Options) -> Pulse:
    """Return the pulse in a file that is named as the value of --pulse."""
    if not Path(file_name).suffix:
        expected = "a heart rate [1/min], or a CSV file with the columns time and value"
        refuse(PULSE_OPTION, expected, f"got {file_name!r}", f"Write {PULSE_OPTION} 72")
    if not Pulse(waveform=file_name).is_recording:
        actual = f"{file_name} has one, as the values of one beat"
        advice = f"Write {PULSE_OPTION} 72 {_option('waveform')} {file_name}"
        refuse(PULSE_OPTION, "a recording with two columns, time and value", actual, advice)
    for field in options:
        if field == "waveform" or field in FIELDS_OF_MODEL:
            actual, advice = f"{PULSE_OPTION} is a recording", f"Write {PULSE_OPTION} 72, or leave it out"
            refuse(_option(field), f"a heart rate in {PULSE_OPTION}", actual, advice)
    return check_fields(Pulse, {**options, "waveform": file_name}, _PULSE_OPTION_NAMES)


def _option(field: str) -> str:
    """Return the option of a field of `Pulse`, such as "--pulse-seed"."""
    return option_name(field, _PULSE_OPTION_NAMES)
