"""States of living skin in a scene, such as a blush, and their time course."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_array
from dermis.base.summary import ShortRepr
from dermis.human.living.zones import STATE_NAMES, check_state_weights, response
from dermis.mesh.head import Head

PULSE_SAMPLE_COUNT = 16
"""Number of samples of the blood volume over the delays of the pulse, from none to the longest."""
_MAX_BLOOD_CHANGE = 0.9


@dataclass(frozen=True, eq=False, repr=False)
class SkinState(ShortRepr):
    """State of the skin of a person at one time: weights of states such as a blush, and the pulse.

    Parameters
    ----------
    weights : mapping of str to float, optional
        Weights of states, 0 to 1: "blush", "pallor", "cold", "exertion" and "crying".
    blood : (16,) array, optional
        Relative change of the blood volume by the pulse where the relative amplitude is 1, for delays evenly
        spaced from 0 to the longest delay of the face, as `Pulse.at` returns it [-]. None for no pulse.

    Raises
    ------
    DermisError
        For unknown states, and for weights and changes out of range.

    Examples
    --------
    >>> import dermis
    >>> dermis.SkinState({"blush": 0.6}).weights
    {'blush': 0.6}
    """

    weights: Mapping[str, float] = field(default_factory=dict)
    blood: Doubles | None = None

    def __post_init__(self) -> None:
        """Check the weights and the changes of the blood volume."""
        if not isinstance(self.weights, Mapping):
            actual = f"got {format_value(self.weights)}"
            refuse("state", f"a mapping from {', '.join(STATE_NAMES)} to weights", actual, "Correct it")
        object.__setattr__(self, "weights", check_state_weights(self.weights))
        if self.blood is not None:
            shape = (PULSE_SAMPLE_COUNT,)
            blood = checked_array("state: blood", self.blood, shape, -_MAX_BLOOD_CHANGE, _MAX_BLOOD_CHANGE)
            object.__setattr__(self, "blood", blood)

    @classmethod
    def coerce(cls, value: object) -> SkinState | None:
        """Convert a mapping of weights to a state; states and None are returned unchanged."""
        if value is None or isinstance(value, SkinState):
            return value
        return cls(value)  # type: ignore[arg-type]


def is_living_head(head: Head, albedo: str) -> bool:
    """Return whether states can change the skin of a head: it must be painted from pigments and use its map.

    albedo : value of `Skin.albedo`
    """
    return head.maps.is_painted and head.maps.colour is None and albedo == "map"


def check_living_head(head: Head, albedo: str) -> None:
    """Raise DermisError for a head whose skin is not painted from pigments, or not rendered in that colour.

    albedo : field of `Skin`
    """
    advice = "Use human, human:SEED or a person (.json) without a colour map, or leave the state out"
    if not head.maps.is_painted or head.maps.colour is not None:
        refuse("state", "a person whose skin is painted from pigments", f"got {head.name!r}", advice)
    if albedo != "map":
        refuse(
            "state", 'albedo = "map"', f"the skin has {albedo!r}", "Change the skin, or leave the state out"
        )


@dataclass(frozen=True)
class StateEvent:
    """Event that causes a state of the skin, such as an embarrassment a blush.

    Parameters
    ----------
    name : str
        State: "blush", "pallor", "cold", "exertion" or "crying".
    weight : float
        Weight that the state approaches, 0 to 1.
    begin_s : float
        Time at which the state starts to rise [s]; by default, it has its full weight until `end_s`.
    end_s : float
        Time at which the state starts to fall [s]; by default, it lasts.

    Raises
    ------
    DermisError
        For an unknown state, and numbers out of range.

    Examples
    --------
    >>> import dermis
    >>> blush = dermis.StateEvent("blush", 0.8, begin_s=1.0, end_s=6.0)
    >>> dermis.StateEvent.weights_at([blush], 0.5)
    {'blush': 0.0}
    """

    name: str
    weight: float
    begin_s: float = -np.inf
    end_s: float = np.inf

    def __post_init__(self) -> None:
        """Check the fields."""
        check_state_weights({self.name: self.weight})
        if not self.begin_s < self.end_s:
            actual = f"got {self.begin_s:g} to {self.end_s:g} s"
            refuse(f"state: {self.name}", "a begin before the end", actual, "Correct it")

    @property
    def is_constant(self) -> bool:
        """Return whether the state has its full weight at all times."""
        return self.begin_s == -np.inf and self.end_s == np.inf

    @staticmethod
    def weights_at(events: Iterable[StateEvent], seconds: float) -> dict[str, float]:
        """Return the weights of states at a time; weights of the same state add up, to at most 1.

        Parameters
        ----------
        events : iterable of StateEvent
            Events that cause states.
        seconds : float
            Time [s].

        Returns
        -------
        dict of str to float
            Weights by name of the state, for `SkinState`.
        """
        weights: dict[str, float] = {}
        for event in events:
            found = response(event.name, event.weight, event.begin_s, event.end_s, seconds)
            weights[event.name] = min(weights.get(event.name, 0.0) + found, 1.0)
        return weights


def state_at(events: Iterable[StateEvent], seconds: float, base: SkinState | None = None) -> SkinState:
    """Return the state of the skin at a time.

    base : state whose pulse is kept, and whose weights apply to states without an event; None for skin at
        rest
    """
    weights = {**(base.weights if base else {}), **StateEvent.weights_at(events, seconds)}
    return SkinState(weights, base.blood if base else None)
