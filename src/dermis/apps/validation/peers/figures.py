"""Noise, errors against the truth, and the time in which Cycles reaches our error."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.cycles import CyclesPass
from dermis.apps.truths.metrics import energy_ratio, relative_rmse
from dermis.apps.truths.path_traced import PathTraced
from dermis.apps.validation.pages import JsonObject
from dermis.apps.validation.peers.rendering import GPU_GEMS_3_VARIANTS, VARIANTS, FrameTimes, PeerRenders

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
CYCLES_NAMES = {"random-walk": "Cycles, random walk", "burley": "Cycles, Burley"}
CLEAN_NOISE = 0.05
"""Noise that is still visible, but no longer hides the picture."""


@dataclass(frozen=True)
class RendererRow:
    """A renderer's figures at one setting.

    setting : technique, or paths
    seconds, core_seconds : of one image, on the clock and of all cores together; None where none was rendered
    noise : relative RMSE of its own noise [-]
    relrmse, energy_ratio : against the truth, with standard errors; None for the truth itself
    """

    renderer: str
    setting: str
    seconds: float | None
    core_seconds: float | None
    noise: float
    relrmse: float | None
    relrmse_se: float | None
    energy_ratio: float | None
    energy_ratio_se: float | None


@dataclass(frozen=True)
class MeanImage:
    """The mean of all passes of a method, and the variance of its noise, each (h, w, 3)."""

    image: Floats
    variance: Floats


def scene_results(measured: PeerRenders) -> JsonObject:
    """Return the figures of one scene, ready for JSON."""
    mask = common_mask(measured)
    means = {method: mean_of_passes(turns) for method, turns in measured.cycles.items()}
    ours = [_dermis_row(measured, name, mask) for name in VARIANTS]
    of_2007 = [_dermis_row(measured, name, mask) for name in GPU_GEMS_3_VARIANTS]
    rows = [*ours, *of_2007, _mitsuba_row(measured, mask)]
    for method, mean in means.items():
        rows += _cycles_rows(measured, method, mean, mask)
    scene: JsonObject = {
        "light": measured.light,
        "region": measured.region,
        "pixels": int(mask.sum()),
        "rows": [asdict(row) for row in rows],
        "left_out": measured.left_out,
        "ours_energy_put_right": {name: _energy_corrected_error(measured, name, mask) for name in VARIANTS},
        "published": {row.setting: _time_ratios(row, ours[0]) for row in of_2007},
    }
    if "random-walk" in means:
        scene["as_near"] = {row.setting: _equal_error_costs(measured, means["random-walk"], row, mask) for row in ours}
    if len(means) == len(CYCLES_NAMES):
        walk, burley = means["random-walk"], means["burley"]
        scene["burley_against_random_walk"] = relative_rmse(
            burley.image, walk.image, mask, walk.variance, burley.variance
        )
    return scene


def common_mask(measured: PeerRenders) -> Mask:
    """Return (h, w) pixels that show nothing but skin, for every renderer."""
    mask = measured.truth.mask > 0.999
    for turns in measured.cycles.values():
        for one in turns[0]:
            mask = mask & (one.coverage > 0.999)
    return mask


def mean_of_passes(turns: Sequence[Sequence[CyclesPass]]) -> MeanImage:
    """Return the mean of all passes; its variance from the difference of the two passes of each level."""
    levels = [level[0].samples for level in zip(*turns, strict=True)]
    image, variance = np.zeros(turns[0][0].image.shape), np.zeros(turns[0][0].image.shape)
    for share, (one, other) in zip(np.divide(levels, sum(levels)), zip(*turns, strict=True), strict=True):
        first, second = (np.asarray(half.image, np.float64) for half in (one, other))
        image += share * 0.5 * (first + second)
        variance += share**2 * 0.25 * (first - second) ** 2
    return MeanImage(image, variance)


def pass_noise(one: NDArray[np.floating], other: NDArray[np.floating], mean: MeanImage, mask: Mask) -> float:
    """Return the relative RMSE of the noise of one of two equal renderings with seeds of their own [-]."""
    apart = np.subtract(one, other, dtype=np.float64)[mask]
    return float(np.sqrt(0.5 * (apart**2).sum() / _signal_energy(mean, mask)))


def samples_for_noise(noise: float, samples: Sequence[int], noises: Sequence[float]) -> float:
    """Return the paths through each pixel for some noise: by one over root N from the nearest level."""
    nearest = int(np.abs(np.log(np.divide(noises, noise))).argmin())
    return float(samples[nearest] * (noises[nearest] / noise) ** 2)


def _signal_energy(mean: MeanImage, mask: Mask) -> float:
    """Return the sum of squares of the picture without its noise."""
    return float((mean.image**2 - mean.variance)[mask].sum())


def _reference_mean(truth: PathTraced) -> MeanImage:
    return MeanImage(truth.image.astype(np.float64), truth.variance.astype(np.float64))


def _dermis_row(measured: PeerRenders, name: str, mask: Mask) -> RendererRow:
    frames, truth = measured.ours[name], measured.truth
    error = relative_rmse(frames.image, truth.image, mask, truth.variance)
    energy = energy_ratio(frames.image, truth.image, mask, truth.variance)
    return RendererRow("dermis", name, *_median_times(frames), 0.0, *error, *energy)


def _median_times(frames: FrameTimes) -> tuple[float, float]:
    return statistics.median(frames.seconds), statistics.median(frames.core_seconds)


def _time_ratios(row: RendererRow, ours: RendererRow) -> dict[str, float]:
    """Return the time of another frame over ours, by the clock and by CPU time."""
    assert row.seconds and row.core_seconds and ours.seconds and ours.core_seconds
    return {"ratio": row.seconds / ours.seconds, "core_ratio": row.core_seconds / ours.core_seconds}


def _mitsuba_row(measured: PeerRenders, mask: Mask) -> RendererRow:
    truth = measured.truth
    noise = float(np.sqrt(truth.variance[mask].sum(dtype=np.float64) / _signal_energy(_reference_mean(truth), mask)))
    setting = _samples_text(truth.samples)
    spent = truth.seconds, measured.truth_core_seconds
    return RendererRow("Mitsuba, volpathmis", setting, *spent, noise, None, None, None, None)


def _cycles_rows(measured: PeerRenders, method: str, mean: MeanImage, mask: Mask) -> list[RendererRow]:
    """Return a row for each level, the mean of its two passes, and one for their mean without noise."""
    truth, rows = measured.truth, []
    for level in zip(*measured.cycles[method], strict=True):
        against = [(one.image, truth.image, mask, truth.variance) for one in level]
        error = np.mean([relative_rmse(*one) for one in against], axis=0).tolist()
        energy = np.mean([energy_ratio(*one) for one in against], axis=0).tolist()
        spent = (
            statistics.mean(one.seconds for one in level),
            statistics.mean(o.core_seconds for o in level),
        )
        noise = pass_noise(level[0].image, level[1].image, mean, mask)
        rows.append(RendererRow(CYCLES_NAMES[method], _samples_text(level[0].samples), *spent, noise, *error, *energy))
    error = relative_rmse(mean.image, truth.image, mask, truth.variance, mean.variance)
    energy = energy_ratio(mean.image, truth.image, mask, truth.variance)
    return [*rows, RendererRow(CYCLES_NAMES[method], "noise taken off", None, None, 0.0, *error, *energy)]


def _equal_error_costs(measured: PeerRenders, mean: MeanImage, ours: RendererRow, mask: Mask) -> JsonObject:
    """Return what the random walk needs for our total error, and for a nearly clean image."""
    truth, levels = measured.truth, list(zip(*measured.cycles["random-walk"], strict=True))
    bias = relative_rmse(mean.image, truth.image, mask, truth.variance, mean.variance).value
    samples = [level[0].samples for level in levels]
    noises = [pass_noise(one.image, other.image, mean, mask) for one, other in levels]
    needed = {"clean": samples_for_noise(CLEAN_NOISE, samples, noises)}
    assert ours.relrmse is not None
    if ours.relrmse > bias:
        # Errors are relative to the truth, noise to the method's own mean.
        to_own = np.sqrt(_signal_energy(_reference_mean(truth), mask) / _signal_energy(mean, mask))
        noise = float(to_own * np.sqrt(ours.relrmse**2 - bias**2))
        needed["same_error"] = samples_for_noise(noise, samples, noises)
    return {goal: _cost(count, levels[-1], ours) for goal, count in needed.items()}


def _cost(count: float, level: Sequence[CyclesPass], ours: RendererRow) -> dict[str, float]:
    """Return the time of so many paths at the speed of one level, and its ratio to our frame."""
    seconds = count * statistics.mean(one.seconds / one.samples for one in level)
    core_seconds = count * statistics.mean(one.core_seconds / one.samples for one in level)
    assert ours.seconds is not None and ours.core_seconds is not None
    longer = {"ratio": seconds / ours.seconds, "core_ratio": core_seconds / ours.core_seconds}
    return {"samples": count, "seconds": seconds, **longer}


def _energy_corrected_error(measured: PeerRenders, name: str, mask: Mask) -> float:
    """Return our error after scaling each channel to the truth's energy [-]."""
    truth, image = measured.truth, measured.ours[name].image.astype(np.float64)
    scale = truth.image[mask].sum(axis=0, dtype=np.float64) / image[mask].sum(axis=0)
    return relative_rmse(image * scale, truth.image, mask, truth.variance).value


def _samples_text(samples: int) -> str:
    return f"{samples} paths a pixel"
