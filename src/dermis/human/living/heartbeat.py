"""Blood volume of the skin and motion of the head over time, from a model of heartbeats or a recording."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dermis.base.arrays import Doubles

_TABLE_SIZE = 512
# Artist's values in the form of two Gaussians over the phase of a beat [Tang2020]: height, centre, width.
_SYSTOLIC, _DIASTOLIC = (1.0, 0.22, 0.075), (0.45, 0.48, 0.10)
# Chosen: relative effects of breathing on the intervals between beats, the strength of the pulse, and the
# blood volume.
_INTERVAL_CHANGE, _STRENGTH_CHANGE, _BASELINE_CHANGE = 0.03, 0.10, 0.15
_MIN_INTERVAL_FACTOR, _MAX_INTERVAL_FACTOR = 0.4, 2.5
# Chosen: recoil of the head as a damped oscillation that starts with each beat.
_RECOIL_HZ, _RECOIL_DECAY_S = 4.0, 0.12
_RECOIL_BEATS = 3  # latest beats whose oscillations are added up
_RECOIL_RANGE = 0.848  # from the lowest to the highest value of the damped oscillation
_MIN_BEAT_INTERVAL_S = 0.33  # shortest interval between detected beats of a recording
_MIN_RELATIVE_SLOPE = 0.4  # slope of detected beats, relative to the steepest slopes of the recording
SPREAD_PERCENTILES = (2.5, 97.5)
"""Percentiles of the values of a recording whose difference is its range, so that outliers do not matter."""


def typical_beat() -> Doubles:
    """Return samples (512,) of the blood volume over a beat with systolic peak and dicrotic notch."""
    phase = np.arange(_TABLE_SIZE) / _TABLE_SIZE
    shifted = phase[:, None] + np.arange(-1.0, 2.0)
    waves = [
        height * np.exp(-((shifted - centre) ** 2) / (2 * width**2)).sum(axis=1)
        for height, centre, width in (_SYSTOLIC, _DIASTOLIC)
    ]
    return np.asarray(waves[0] + waves[1])


def normalised_beat(samples: Doubles) -> Doubles:
    """Return a beat (512,), resampled and scaled to a mean of 0 and a peak-to-peak range of 1."""
    phase = np.arange(_TABLE_SIZE) / _TABLE_SIZE
    beat = np.interp(phase, np.arange(len(samples)) / len(samples), samples, period=1.0)
    return np.asarray((beat - beat.mean()) / np.ptp(beat))


def _recoil(seconds: Doubles) -> Doubles:
    """Return the displacement of the head at times after the start of a beat, with a range of 1 [-]."""
    after = np.maximum(seconds, 0.0)
    wave = np.sin(2 * np.pi * _RECOIL_HZ * after) * np.exp(-after / _RECOIL_DECAY_S)
    return np.asarray(-wave / _RECOIL_RANGE)


@dataclass(frozen=True, eq=False)
class ModelledPulse:
    """Pulse from a model: beats of equal waveform, at intervals that vary at random and with breathing.

    rate_per_min : mean rate [1/min]
    beat : (n,) samples of one beat, from `normalised_beat`
    variability_s : standard deviation of the intervals between beats [s]
    respiration_hz : frequency of breathing [1/s]; 0 for a pulse without effects of breathing
    seed : seed of the random intervals
    """

    rate_per_min: float
    beat: Doubles
    variability_s: float = 0.0
    respiration_hz: float = 0.0
    seed: int = 0

    @property
    def duration_s(self) -> float:
        """Return the time up to which the pulse is known: infinite."""
        return float("inf")

    def beat_times(self, end_s: float) -> Doubles:
        """Return the start times of the beats from before 0 to after a time [s].

        The first times do not depend on `end_s`.
        """
        mean_s = 60.0 / self.rate_per_min
        count = int((end_s / mean_s + 2) / _MIN_INTERVAL_FACTOR) + _RECOIL_BEATS + 2
        noise = np.random.default_rng(self.seed).normal(size=count)
        breathing = np.sin(2 * np.pi * self.respiration_hz * mean_s * np.arange(count))
        factors = 1.0 + self.variability_s / mean_s * noise + _INTERVAL_CHANGE * breathing
        intervals = mean_s * np.clip(factors, _MIN_INTERVAL_FACTOR, _MAX_INTERVAL_FACTOR)
        starts = np.concatenate([[0.0], np.cumsum(intervals)])
        return np.concatenate([-mean_s * np.arange(_RECOIL_BEATS, 0, -1), starts])

    def blood(self, seconds: Doubles) -> Doubles:
        """Return the change of the blood volume at times [s]; the mean is 0, and the range about 1 [-]."""
        starts = self.beat_times(float(np.max(seconds)))
        index = np.clip(np.searchsorted(starts, seconds, "right") - 1, 0, len(starts) - 2)
        phase = (seconds - starts[index]) / (starts[index + 1] - starts[index])
        wave = np.interp(phase, np.arange(_TABLE_SIZE) / _TABLE_SIZE, self.beat, period=1.0)
        breath = np.sin(2 * np.pi * self.respiration_hz * seconds)
        return np.asarray(wave * (1.0 + _STRENGTH_CHANGE * breath) + _BASELINE_CHANGE * breath)

    def recoil(self, seconds: float) -> float:
        """Return the displacement of the head at a time [s], with a range of about 1 [-]."""
        starts = self.beat_times(seconds)
        last = int(np.searchsorted(starts, seconds, "right"))
        return float(_recoil(seconds - starts[max(last - _RECOIL_BEATS, 0) : last]).sum())

    def mean_rate_per_min(self, begin_s: float, end_s: float) -> float:
        """Return the mean rate of the beats that start in a time span [1/min]."""
        return _mean_rate(self.beat_times(end_s), begin_s, end_s, self.rate_per_min)


@dataclass(frozen=True, eq=False)
class RecordedPulse:
    """Pulse from a photoplethysmogram, in which higher values mean more blood.

    times_s : (n,) increasing times, from 0 [s]
    values : (n,) values of the recording, in any unit
    """

    times_s: Doubles
    values: Doubles

    @property
    def duration_s(self) -> float:
        """Return the time of the last value [s]."""
        return float(self.times_s[-1])

    @cached_property
    def _scaled(self) -> Doubles:
        """Return the values scaled to a mean of 0 and a range of about 1 [-]."""
        low, high = np.percentile(self.values, SPREAD_PERCENTILES)
        return np.asarray((self.values - self.values.mean()) / (high - low))

    @cached_property
    def _starts(self) -> Doubles:
        """Return the times at which the recording rises most steeply, one per beat [s]."""
        from scipy.signal import find_peaks

        step = float(np.median(np.diff(self.times_s)))
        even = np.arange(0.0, self.times_s[-1], step)
        slope = np.gradient(np.interp(even, self.times_s, self._scaled), step)
        distance = max(1, round(_MIN_BEAT_INTERVAL_S / step))
        peaks, _ = find_peaks(slope, distance=distance, height=_MIN_RELATIVE_SLOPE * np.percentile(slope, 99))
        return np.asarray(even[peaks])

    def blood(self, seconds: Doubles) -> Doubles:
        """Return the change of the blood volume at times [s]; the mean is 0, and the range about 1 [-].

        Before the recording, its first value holds.
        """
        return np.interp(seconds, self.times_s, self._scaled)

    def recoil(self, seconds: float) -> float:
        """Return the displacement of the head at a time [s], with a range of about 1 [-]."""
        starts = self._starts[self._starts <= seconds][-_RECOIL_BEATS:]
        return float(_recoil(seconds - starts).sum())

    def mean_rate_per_min(self, begin_s: float, end_s: float) -> float:
        """Return the mean rate of the beats that start in a time span [1/min]; NaN for fewer than two."""
        return _mean_rate(self._starts, begin_s, end_s, float("nan"))


def _mean_rate(starts_s: Doubles, begin_s: float, end_s: float, default: float) -> float:
    """Return the mean rate of the beats that start in a time span [1/min]; `default` for fewer than two."""
    inside = starts_s[(starts_s >= begin_s) & (starts_s <= end_s)]
    return default if len(inside) < 2 else float(60.0 * (len(inside) - 1) / (inside[-1] - inside[0]))
