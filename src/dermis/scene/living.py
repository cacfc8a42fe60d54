"""State of living skin in a scene: blush and other states, and the pulse at a time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from dermis.base.arrays import Doubles
from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_array, checked_number
from dermis.base.reading import checked_path, read_text
from dermis.base.summary import ShortRepr
from dermis.base.tables import column_separator
from dermis.human.living.heartbeat import ModelledPulse, RecordedPulse, normalised_beat, typical_beat
from dermis.human.living.zones import (
    MAX_TIME_S,
    STATE_NAMES,
    check_state_weights,
    longest_delay_s,
    response,
)
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose, merge_poses
from dermis.mesh.rotations import angles_matrix
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel, slider

if TYPE_CHECKING:
    from dermis.scene.model import Scene

PULSE_SAMPLE_COUNT = 16
"""Number of samples of the blood volume over the delays of the pulse, from none to the longest."""
TYPICAL_BEAT = "typical"
"""Name of the form of a beat that is not read from a file."""
_HEAD_BONE = "head"
_FACE_LEVER_MM = 90.0  # distance of the face in front of the joint of the head, about which the head nods
_MAX_BLOOD_CHANGE = 0.9
_MAX_FILE_BYTES, _MIN_BEAT_SAMPLES, _MIN_RECORDING_S = 64 << 20, 8, 2.0
_FIELDS_OF_MODEL = ("rate_per_min", "variability_ms", "respiration_per_min", "seed")


@dataclass(frozen=True, eq=False, repr=False)
class SkinState(ShortRepr):
    """Momentary state of the skin of a person: a blush or other states, and the pulse.

    Parameters
    ----------
    weights : mapping of str to float, optional
        Weights of states, 0 to 1: "blush", "pallor", "cold", "exertion" and "crying".
    blood : (16,) array, optional
        Relative change of the blood volume by the pulse, where its amplitude is 1, for delays evenly spaced
        from 0 to the longest delay of the face, as `Pulse.at` returns it [-]. None for no pulse.

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


def check_living_head(head: Head, albedo: str) -> None:
    """Raise DermisError for a head whose skin colour is not painted from pigments.

    albedo : source of the colour of the skin, see `Skin`
    """
    advice = "Use human, human:SEED or a person (.json) without a colour map, or leave the state out"
    if not head.maps.is_painted or head.maps.colour is not None:
        refuse("state", "a person whose skin is painted from pigments", f"got {head.name!r}", advice)
    if albedo != "map":
        refuse("state", 'albedo = "map"', f"the skin has {albedo!r}", "Change the skin, or leave the state out")


class PulseSample(NamedTuple):
    """Pulse at a time.

    blood : (16,) relative change of the blood volume, see `SkinState` [-]
    nod_degrees : rotation of the head about x by the recoil of the heartbeat [degrees]
    """

    blood: Doubles
    nod_degrees: float


class Pulse(FrozenModel):
    """Heartbeat of a person: change of the blood volume of the skin over time, and recoil of the head.

    Sources: [Tang2020] for the form of a beat, docs/living.md for amplitude and delays.

    Examples
    --------
    >>> import dermis
    >>> scene = dermis.Scene(dermis.Human().head(subdivide=0))
    >>> frames = [dermis.Pulse(rate_per_min=72).scene_at(scene, k / 25) for k in range(50)]
    >>> len(frames[0].state.blood)
    16
    """

    rate_per_min: Annotated[
        float,
        Field(ge=20, le=250, json_schema_extra=slider(40, 180)),
        BoundsReason("1/min: hearts beat neither slower nor faster"),
    ] = 72.0
    """Mean heart rate [1/min]."""
    amplitude: Annotated[
        float, Field(ge=0, le=0.5, json_schema_extra=slider(0, 0.2)), BoundsReason("of the blood volume")
    ] = 0.02
    """Change of the blood volume of the forehead over a beat, from lowest to highest, relative to its mean."""
    variability_ms: Annotated[float, Field(ge=0, le=200), BoundsReason("ms: more is an arrhythmia")] = 0.0
    """Standard deviation of the intervals between beats [ms]."""
    respiration_per_min: Annotated[float, Field(ge=0, le=60)] = 0.0
    """Rate of breathing, which changes intervals, strength and blood volume; 0 for none [1/min]."""
    head_motion_mm: Annotated[
        float, Field(ge=0, le=5, json_schema_extra=slider(0, 1)), BoundsReason("mm: more is a nod")
    ] = 0.1
    """Vertical motion of the face by the recoil of the heartbeat, from lowest to highest [mm]."""
    waveform: str = TYPICAL_BEAT
    """Form of a beat: "typical", a CSV file with one column for a beat at evenly spaced times, or a CSV file
    with the columns time [s] and value for a recording (photoplethysmogram), in which more blood is higher."""
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    """Seed of the intervals between beats."""

    @model_validator(mode="after")
    def _check_recording(self) -> Pulse:
        if isinstance(self.signal(), RecordedPulse):
            for name in _FIELDS_OF_MODEL:
                if name in self.model_fields_set:
                    advice = "Leave it out, or give the form of one beat"
                    refuse(f"pulse: {name}", "no value beside a recording, which has its own", "it is given", advice)
        return self

    def signal(self) -> ModelledPulse | RecordedPulse:
        """Return the pulse as a function of time; a file with the form of a beat is read and cached."""
        return _signal(
            self.waveform, self.rate_per_min, self.variability_ms, self.respiration_per_min, self.seed
        )

    def at(self, seconds: float) -> PulseSample:
        """Return the pulse at a time.

        Parameters
        ----------
        seconds : float
            Time since the start of a beat, at least 0 [s].

        Returns
        -------
        PulseSample
            Changes of the blood volume for `SkinState`, and rotation of the head.

        Raises
        ------
        DermisError
            For an invalid time.
        """
        time_s = checked_number("pulse: time", seconds, 0.0, MAX_TIME_S, "s")
        signal = self.signal()
        delays = np.linspace(0.0, longest_delay_s(), PULSE_SAMPLE_COUNT)
        nod = np.degrees(self.head_motion_mm / _FACE_LEVER_MM) * signal.recoil(time_s)
        return PulseSample(self.amplitude * signal.blood(time_s - delays), float(nod))

    def scene_at(self, scene: Scene, seconds: float) -> Scene:
        """Return a scene with the pulse at a time; states and the pose of the scene are kept.

        Parameters
        ----------
        scene : Scene
            Scene with a person.
        seconds : float
            Time since the start of a beat, at least 0 [s].

        Returns
        -------
        Scene
            The scene, in which blood volume and head are those of the time.

        Raises
        ------
        DermisError
            For an invalid time, and for heads without painted skin.
        """
        sample = self.at(seconds)
        weights = scene.state.weights if scene.state else {}
        pose = scene.pose if self.head_motion_mm == 0.0 else with_nod(scene.pose, sample.nod_degrees)
        return scene.replace(state=SkinState(weights, sample.blood), pose=pose)


def with_nod(pose: Pose | None, nod_degrees: float) -> Pose:
    """Return a pose in which the head is rotated about x, in addition to its rotation in `pose`."""
    base = pose or Pose()
    before: Any = base.bones.get(_HEAD_BONE, (0.0, 0.0, 0.0))
    if np.shape(before) == (3,):
        rotation: Any = (before[0] + nod_degrees, before[1], before[2])
    else:
        rotation = np.array(before, np.float64)
        rotation[:3, :3] = rotation[:3, :3] @ np.array(angles_matrix((nod_degrees, 0.0, 0.0)))[:3, :3]
    return merge_poses(Pose(bones={_HEAD_BONE: rotation}), base)


@lru_cache(maxsize=32)
def _signal(
    waveform: str, rate_per_min: float, variability_ms: float, respiration_per_min: float, seed: int
) -> ModelledPulse | RecordedPulse:
    table = typical_beat()[:, None] if waveform == TYPICAL_BEAT else _read_columns(waveform)
    if table.shape[1] == 2:
        return RecordedPulse(*_checked_recording(waveform, table))
    beat = table[:, 0]
    if len(beat) < _MIN_BEAT_SAMPLES or np.ptp(beat) == 0.0:
        expected = f"at least {_MIN_BEAT_SAMPLES} different values over one beat"
        refuse(waveform, expected, f"got {len(beat)} with a range of {np.ptp(beat):g}", "Correct it")
    beat = normalised_beat(beat)
    return ModelledPulse(rate_per_min, beat, 1e-3 * variability_ms, respiration_per_min / 60.0, seed)


def _read_columns(file_name: str) -> Doubles:
    """Return the table (n, 1 or 2) of a CSV file, without a header line."""
    expected = f"{TYPICAL_BEAT}, or a CSV file with one column (a beat) or two (time, value)"
    path = checked_path(file_name, expected)
    lines = [line for line in read_text(path, expected, _MAX_FILE_BYTES).splitlines() if line.strip() and line[0] != "#"]
    rows = [_numbers(line) for line in lines]
    if rows and rows[0] is None:
        lines, rows = lines[1:], rows[1:]
    for line, row in zip(lines, rows, strict=True):
        if row is None or len(row) != len(rows[0] or ()) or len(row) not in (1, 2):
            refuse(path, "one or two numbers in each line, as in the first", f"got {format_value(line)}", "Correct it")
    if not rows:
        refuse(path, expected, "it is empty", "Correct it")
    return np.array(rows, np.float64)


def _numbers(line: str) -> list[float] | None:
    """Return the numbers of a line of a table; None if it has others than finite numbers."""
    mark = column_separator(line)
    texts = line.split(mark) if mark == "," else line.replace(",", ".").split(mark)
    try:
        numbers = [float(text) for text in texts]
    except ValueError:
        return None
    return numbers if np.isfinite(numbers).all() else None


def _checked_recording(file_name: str | Path, table: Doubles) -> tuple[Doubles, Doubles]:
    """Return times from 0 [s] and values of a recording; raise DermisError if it cannot be used."""
    times = table[:, 0] - table[0, 0]
    if len(times) < 2 or (np.diff(times) <= 0).any():
        refuse(file_name, "increasing times [s] in the first column", "they are not", "Correct it")
    if times[-1] < _MIN_RECORDING_S or times[-1] > MAX_TIME_S:
        expected = f"a recording of {_MIN_RECORDING_S:g} to {MAX_TIME_S:g} s"
        refuse(file_name, expected, f"it lasts {times[-1]:g} s", "Give times in seconds")
    if np.ptp(np.percentile(table[:, 1], (2.5, 97.5))) == 0.0:
        refuse(file_name, "values that change", "they are constant", "Correct it")
    return times, table[:, 1]


@dataclass(frozen=True)
class StateEvent:
    """Cause of a state of the skin over a time span.

    Parameters
    ----------
    name : str
        State: "blush", "pallor", "cold", "exertion" or "crying".
    weight : float
        Weight that the state approaches, 0 to 1.
    begin_s : float
        Time at which the state starts to rise [s]; by default it has its full weight from the start.
    end_s : float
        Time at which the state starts to fall [s]; by default it stays.

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

    @staticmethod
    def weights_at(events: Iterable[StateEvent], seconds: float) -> dict[str, float]:
        """Return the weights of all states at a time; causes of the same state add up, to at most 1.

        Parameters
        ----------
        events : iterable of StateEvent
            Causes of states.
        seconds : float
            Time [s].

        Returns
        -------
        dict of str to float
            Weights by state, for `SkinState`.
        """
        weights: dict[str, float] = {}
        for event in events:
            found = response(event.name, event.weight, event.begin_s, event.end_s, seconds)
            weights[event.name] = min(weights.get(event.name, 0.0) + found, 1.0)
        return weights
