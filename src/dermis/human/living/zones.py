"""Zones of the face in which the pulse and states such as a blush change the skin, and times of states."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import cache
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Floats
from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_number
from dermis.base.tables import read_rows

_MASKS = ("everywhere", "lips", "lid edges")
_STATE_QUANTITIES = ("blood", "oxygen", "strength", "roughness")
LARGEST_OXYGEN_DROP = 0.4
"""Largest decrease of the oxygen saturation by states [-]."""


class ZoneChanges(NamedTuple):
    """Changes of four quantities of the skin by zones of the face, which add up where zones overlap.

    zones : (k, 4) changes at the centre of each zone of zones.csv
    masks : (3, 4) changes everywhere, on the lips, and at the edges of the lids
    """

    zones: Floats
    masks: Floats


@cache
def _zone_indices() -> dict[str, int]:
    return {row["zone"]: index for index, row in enumerate(read_rows("dermis.human.skin", "zones"))}


def _no_changes() -> ZoneChanges:
    return ZoneChanges(
        np.zeros((len(_zone_indices()), 4), np.float32), np.zeros((len(_MASKS), 4), np.float32)
    )


def _add(changes: ZoneChanges, zone: str, values: Iterable[float]) -> None:
    """Add the changes of a row of a table to those of its zone or mask."""
    rows, index = (
        (changes.masks, _MASKS.index(zone)) if zone in _MASKS else (changes.zones, _zone_indices()[zone])
    )
    rows[index] += np.array([*values], np.float32)


@cache
def pulse_changes() -> ZoneChanges:
    """Return weighted amplitude, weighted delay [s] and weight of the pulse by zones.

    The fourth quantity is 0. At a point of the skin, amplitude [-] and delay [s] of the pulse are their sums
    over the zones, divided by the sum of the weights.
    """
    changes = _no_changes()
    for row in read_rows(__package__, "pulse_zones"):
        weight = float(row["weight"])
        _add(
            changes,
            row["zone"],
            (weight * float(row["amplitude"]), 1e-3 * weight * float(row["delay_ms"]), weight, 0.0),
        )
    return changes


@cache
def longest_delay_s() -> float:
    """Return the longest delay of the pulse in the table of zones [s]."""
    return max(1e-3 * float(row["delay_ms"]) for row in read_rows(__package__, "pulse_zones"))


class StateTimes(NamedTuple):
    """Time constants with which a state of the skin rises and falls [s]."""

    rise_s: float
    fall_s: float


@cache
def state_times() -> Mapping[str, StateTimes]:
    """Return the time constants of each state by name, such as "blush"."""
    rows = read_rows(__package__, "state_times")
    return {row["state"]: StateTimes(float(row["rise_s"]), float(row["fall_s"])) for row in rows}


STATE_NAMES = tuple(row["state"] for row in read_rows(__package__, "state_times"))
"""Names of the states of the skin."""


def check_state_weights(weights: Mapping[str, float], error_subject: str = "state") -> dict[str, float]:
    """Return weights of states as a dictionary of floats.

    Raises DermisError for unknown states and weights outside 0 to 1.
    """
    for name in weights:
        if name not in STATE_NAMES:
            refuse(
                error_subject, f"one of {', '.join(STATE_NAMES)}", f"got {format_value(name)}", "Correct it"
            )
    return {
        name: checked_number(f"{error_subject}: {name}", weight, 0.0, 1.0) for name, weight in weights.items()
    }


def state_changes(weights: Mapping[str, float]) -> ZoneChanges:
    """Return the changes of the skin by states with given weights, 0 to 1.

    The four quantities are the base-2 logarithm of the factor by which the blood volume changes, and the
    changes of the oxygen saturation, of the specular strength relative to the default, and of the roughness.
    """
    changes = _no_changes()
    for row in read_rows(__package__, "states"):
        if weight := weights.get(row["state"], 0.0):
            _add(changes, row["zone"], (weight * float(row[name]) for name in _STATE_QUANTITIES))
    return changes


def eye_redness(weights: Mapping[str, float]) -> float:
    """Return the increase of the redness of the white of the eye by states, 0 to 1 [-]."""
    rows = read_rows(__package__, "state_times")
    return min(sum(weights.get(row["state"], 0.0) * float(row["eye_redness"]) for row in rows), 1.0)


def response(state: str, weight: float, begin_s: float, end_s: float, seconds: float) -> float:
    """Return the weight of a state at a time, for an event that lasts from `begin_s` to `end_s`.

    From the begin on, the weight approaches `weight` exponentially with the rise time of the state; from the
    end on, it decreases exponentially with the fall time. Before the end of an event with `begin_s` = -inf,
    the result is `weight`.

    weight : weight that the state approaches, 0 to 1
    seconds : time [s]
    """
    rise_s, fall_s = state_times()[state]
    if seconds <= begin_s:
        return 0.0
    reached = (
        weight if math.isinf(begin_s) else weight * -math.expm1(-(min(seconds, end_s) - begin_s) / rise_s)
    )
    return reached * math.exp(-max(seconds - end_s, 0.0) / fall_s)
