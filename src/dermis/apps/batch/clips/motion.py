"""Generated motion of a person: blinks, saccades, speech-like movements, rotation of the head, and the pulse.

Motion is defined before the first and after the last frame too, so that these frames have flow.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

import numpy as np

from dermis.base.arrays import Doubles
from dermis.scene.pulse import Pulse

_LEAD_S = 3.0  # time before the first frame from which events are generated
_PULSE_LEAD_S = 1.0  # smallest time of the pulse at the first frame
_CLOSING_S, _CLOSED_S, _OPENING_S, _MIN_BLINK_INTERVAL_S = 0.09, 0.03, 0.19, 0.4
_SACCADE_S, _SACCADE_S_PER_DEG = 0.021, 0.0022
_MIN_FIXATION_S, _PITCH_OF_YAW = 0.15, 0.6
_HEAD_AXIS_FACTORS = 1.0, 0.6, 0.4  # of yaw, pitch and roll
_HEAD_WAVES, _MAX_GAZE_SPREADS = 5, 2.0
_SYLLABLE_OVERLAP = 1.5  # duration of a syllable's movement relative to the interval of syllables
_LIP_SHAPES: tuple[Mapping[str, float], ...] = tuple(
    tomllib.loads(resources.files(__package__).joinpath("lips.toml").read_text("utf-8"))["shapes"]
)
_JAW_RANGE = 0.08, 0.38  # weight of jawOpen of a syllable
_EYE_TARGETS = "eyeBlinkLeft", "eyeBlinkRight"
MOVED_TARGETS: tuple[str, ...] = (
    *_EYE_TARGETS,
    "jawOpen",
    *dict.fromkeys(name for shape in _LIP_SHAPES for name in shape),
)
"""Morph targets that generated motion moves."""


@dataclass(frozen=True)
class MotionSample:
    """Generated motion at one time.

    blink : closure of the lids [-]
    gaze_deg : yaw to the head's left and pitch downwards of the gaze, relative to its target [degrees]
    head_deg : yaw, pitch and roll of the head, relative to its pose [degrees]
    speech : weights of jaw and lips by name of the morph target
    """

    blink: float
    gaze_deg: tuple[float, float]
    head_deg: tuple[float, float, float]
    speech: Mapping[str, float]

    def moved_weight(self, target_name: str, weight: float) -> float:
        """Return the weight of a morph target, given the weight without motion."""
        if target_name in _EYE_TARGETS:
            return weight + (1.0 - weight) * self.blink
        return max(
            min(weight + self.speech.get(target_name, 0.0), 1.0), weight
        )  # weights of [pose] may exceed 1


def motion_at(seed: int, duration_s: float, clip_values: Mapping[str, float], time_s: float) -> MotionSample:
    """Return the generated motion of a clip at a time.

    seed : seed of the clip, from 0 to 2**63 - 1
    duration_s : duration of the clip [s]
    clip_values : numbers of the table [clip], by key
    time_s : time since the first frame [s]
    """
    events = _events(seed, duration_s, tuple(sorted(clip_values.items())))
    return MotionSample(events.blink(time_s), events.gaze(time_s), events.head(time_s), events.speech(time_s))


def clip_pulse(seed: int, clip_values: Mapping[str, float]) -> Pulse:
    """Return the pulse of a clip, whose times are those of `pulse_time_s`."""
    return Pulse(
        rate_per_min=clip_values["pulse_per_min"],
        amplitude=clip_values["pulse_amplitude"],
        variability_ms=clip_values["pulse_variability_ms"],
        respiration_per_min=clip_values["respiration_per_min"],
        seed=seed,
    )


def pulse_time_s(seed: int, clip_values: Mapping[str, float], time_s: float) -> float:
    """Return the time of the pulse at a time of the clip [s]; the seed determines the phase at the start."""
    return _PULSE_LEAD_S + 60.0 / clip_values["pulse_per_min"] * (seed % 1000) / 1000.0 + time_s


@dataclass(frozen=True, eq=False)
class _Events:
    """Events of a clip, from which the motion at any time follows.

    blinks : (b,) start of each blink [s]
    fixations : (f, 3) start [s], yaw and pitch [degrees] of each fixation
    syllables : (s, 4) start [s], duration [s], weight of the jaw and number of the lip shape of each syllable
    waves : (3, n, 3) amplitude [degrees], frequency [1/s] and phase of the waves of the head's rotation
    """

    blinks: Doubles
    fixations: Doubles
    syllables: Doubles
    waves: Doubles

    def blink(self, time_s: float) -> float:
        since = time_s - self.blinks
        closing = _smooth_step(since / _CLOSING_S)
        opening = _smooth_step((since - _CLOSING_S - _CLOSED_S) / _OPENING_S)
        return float(np.max(closing - opening, initial=0.0))

    def gaze(self, time_s: float) -> tuple[float, float]:
        if not len(self.fixations):
            return 0.0, 0.0
        k = max(int(np.searchsorted(self.fixations[:, 0], time_s, side="right")) - 1, 0)
        now, before = self.fixations[k, 1:], self.fixations[max(k - 1, 0), 1:]
        duration = _SACCADE_S + _SACCADE_S_PER_DEG * float(np.linalg.norm(now - before))
        done = float(_smooth_step((time_s - self.fixations[k, 0]) / duration))
        yaw, pitch = before + done * (now - before)
        return float(yaw), float(pitch)

    def head(self, time_s: float) -> tuple[float, float, float]:
        amplitude, frequency, phase = np.moveaxis(self.waves, 2, 0)
        yaw, pitch, roll = (amplitude * np.sin(2 * np.pi * frequency * time_s + phase)).sum(axis=1)
        return float(yaw), float(pitch), float(roll)

    def speech(self, time_s: float) -> dict[str, float]:
        weights: dict[str, float] = {}
        begins, durations = self.syllables[:, 0], self.syllables[:, 1]
        for begin, duration, jaw, shape in self.syllables[(begins < time_s) & (time_s < begins + durations)]:
            bump = 0.5 - 0.5 * np.cos(2 * np.pi * (time_s - begin) / duration)
            amount = jaw / _JAW_RANGE[1]
            for name, weight in {"jawOpen": _JAW_RANGE[1], **_LIP_SHAPES[int(shape)]}.items():
                weights[name] = weights.get(name, 0.0) + float(amount * bump * weight)
        return weights


@lru_cache(maxsize=8)
def _events(seed: int, duration_s: float, clip_items: tuple[tuple[str, float], ...]) -> _Events:
    values, end_s = dict(clip_items), duration_s + 1.0
    streams = [np.random.default_rng([seed, k]) for k in range(4)]
    return _Events(
        np.array(_random_times(streams[0], values["blinks_per_min"], _MIN_BLINK_INTERVAL_S, end_s)),
        _fixations(streams[1], values, end_s),
        _syllables(streams[2], values, end_s),
        _waves(streams[3], values),
    )


def _random_times(
    rng: np.random.Generator, rate_per_min: float, min_interval_s: float, end_s: float
) -> list[float]:
    """Return random times, whose intervals are the shortest interval plus an exponential random number."""
    times, time_s = [], -_LEAD_S
    mean_s = max(60.0 / rate_per_min - min_interval_s, 0.1) if rate_per_min else np.inf
    while mean_s < np.inf and (time_s := time_s - mean_s * float(np.log1p(-rng.random()))) < end_s:
        times.append(time_s)
        time_s += min_interval_s
    return times


def _fixations(rng: np.random.Generator, values: Mapping[str, float], end_s: float) -> Doubles:
    times = _random_times(rng, values["gaze_shifts_per_min"], _MIN_FIXATION_S, end_s)
    spread = values["gaze_spread_deg"] * np.array([1.0, _PITCH_OF_YAW])
    rows = []
    for time_s in times:
        radius, angle = np.sqrt(-2.0 * np.log1p(-rng.random())), 2 * np.pi * rng.random()
        offset = min(radius, _MAX_GAZE_SPREADS) * np.array([np.cos(angle), np.sin(angle)])
        rows.append([time_s, *(spread * offset)])
    return np.array(rows, np.float64).reshape(-1, 3)


def _syllables(rng: np.random.Generator, values: Mapping[str, float], end_s: float) -> Doubles:
    rows, time_s = [], -_LEAD_S * float(rng.random())
    while values["speech"] and time_s < end_s:
        for _ in range(4 + int(9 * rng.random())):
            interval = (0.75 + 0.5 * rng.random()) / values["syllables_per_s"]
            jaw = _JAW_RANGE[0] + (_JAW_RANGE[1] - _JAW_RANGE[0]) * rng.random()
            shape = int(len(_LIP_SHAPES) * rng.random())
            rows.append([time_s, _SYLLABLE_OVERLAP * interval, values["speech"] * jaw, shape])
            time_s += interval
        time_s += 0.25 + 0.8 * float(rng.random())
    return np.array(rows, np.float64).reshape(-1, 4)


def _waves(rng: np.random.Generator, values: Mapping[str, float]) -> Doubles:
    waves = np.empty((3, _HEAD_WAVES, 3))
    for axis, factor in enumerate(_HEAD_AXIS_FACTORS):
        shares = 0.5 + rng.random(_HEAD_WAVES)
        frequencies = values["head_motion_hz"] * (0.4 + 1.2 * rng.random(_HEAD_WAVES))
        amplitudes = shares * np.sqrt(2.0 / (shares**2).sum()) * factor * values["head_motion_deg"]
        waves[axis] = np.stack([amplitudes, frequencies, 2 * np.pi * rng.random(_HEAD_WAVES)], axis=-1)
    return waves


def _smooth_step(progress: Doubles | float) -> Doubles:
    """Return the minimum-jerk path from 0 to 1."""
    x = np.clip(progress, 0.0, 1.0)
    return np.asarray(x**3 * (10.0 + x * (6.0 * x - 15.0)))
