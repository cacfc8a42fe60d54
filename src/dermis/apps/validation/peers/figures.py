"""Noise and errors of dermis, Cycles and Mitsuba, and the time that Cycles needs for equal errors."""

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
from dermis.apps.validation.peers.rendering import DERMIS_VARIANTS, GPU_GEMS_3_VARIANTS, SceneRenders

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
CYCLES_NAMES = {"random-walk": "Cycles, random walk", "burley": "Cycles, Burley"}
LOW_NOISE_TARGET = 0.05
"""Relative noise of an image in which noise is hardly visible [-]."""


@dataclass(frozen=True)
class RendererRow:
    """Times and errors of a renderer with one setting.

    setting : technique of dermis, or paths per pixel of a path tracer
    seconds : elapsed time of one image [s]; None if the image is an average of other images
    core_seconds : CPU time of one image [s]; None if the image is an average of other images
    noise : relative RMS of the noise in the image [-]
    relrmse : relative RMSE against the reference [-]; None for the reference itself
    relrmse_se : standard error of `relrmse`
    energy_ratio : total light, divided by the total light of the reference [-]; None for the reference itself
    energy_ratio_se : standard error of `energy_ratio`
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
    """Mean (h, w, 3) of all images rendered by a Cycles method, and the variance (h, w, 3) of its noise."""

    image: Floats
    variance: Floats


def scene_results(scene_renders: SceneRenders) -> JsonObject:
    """Return the times and errors of all renderers in one scene as a JSON object."""
    mask = skin_only_mask(scene_renders)
    means = {method: mean_of_passes(turns) for method, turns in scene_renders.cycles.items()}
    ours = [_dermis_row(scene_renders, name, mask) for name in DERMIS_VARIANTS]
    gpu_gems_3 = [_dermis_row(scene_renders, name, mask) for name in GPU_GEMS_3_VARIANTS]
    rows = [*ours, *gpu_gems_3, _mitsuba_row(scene_renders, mask)]
    for method, mean in means.items():
        rows += _cycles_rows(scene_renders, method, mean, mask)
    scene: JsonObject = {
        "light": scene_renders.light,
        "region": scene_renders.region,
        "pixels": int(mask.sum()),
        "rows": [asdict(row) for row in rows],
        "left_out": scene_renders.left_out,
        "ours_energy_put_right": {
            name: _energy_corrected_error(scene_renders, name, mask) for name in DERMIS_VARIANTS
        },
        "published": {row.setting: _time_ratios(row, ours[0]) for row in gpu_gems_3},
    }
    if "random-walk" in means:
        mean = means["random-walk"]
        scene["as_near"] = {row.setting: _equal_error_costs(scene_renders, mean, row, mask) for row in ours}
    if len(means) == len(CYCLES_NAMES):
        random_walk, burley = means["random-walk"], means["burley"]
        scene["burley_against_random_walk"] = relative_rmse(
            burley.image, random_walk.image, mask, random_walk.variance, burley.variance
        )
    return scene


def skin_only_mask(scene_renders: SceneRenders) -> Mask:
    """Return the mask (h, w) of pixels that show only skin in the pictures of all renderers."""
    mask = scene_renders.reference.mask > 0.999
    for turns in scene_renders.cycles.values():
        for one in turns[0]:
            mask = mask & (one.coverage > 0.999)
    return mask


def mean_of_passes(passes_by_turn: Sequence[Sequence[CyclesPass]]) -> MeanImage:
    """Return the mean of all images rendered by a Cycles method, and the variance of its noise.

    The variance is estimated from the differences between images with equal numbers of paths.

    passes_by_turn : two lists of images; images at the same index differ only in their random seeds
    """
    levels = [level[0].samples for level in zip(*passes_by_turn, strict=True)]
    image, variance = np.zeros(passes_by_turn[0][0].image.shape), np.zeros(passes_by_turn[0][0].image.shape)
    for fraction, (one, other) in zip(
        np.divide(levels, sum(levels)), zip(*passes_by_turn, strict=True), strict=True
    ):
        first, second = (np.asarray(half.image, np.float64) for half in (one, other))
        image += fraction * 0.5 * (first + second)
        variance += fraction**2 * 0.25 * (first - second) ** 2
    return MeanImage(image, variance)


def pass_noise(
    first_pass: NDArray[np.floating], second_pass: NDArray[np.floating], mean_image: MeanImage, mask: Mask
) -> float:
    """Return the relative RMS noise of a pair of images that differ only in their random seeds [-].

    first_pass, second_pass : (h, w, 3) images
    mean_image : mean of all images; the noise is relative to its RMS
    mask : (h, w) mask of the pixels to compare
    """
    difference = np.subtract(first_pass, second_pass, dtype=np.float64)[mask]
    return float(np.sqrt(0.5 * (difference**2).sum() / _signal_energy(mean_image, mask)))


def samples_for_noise(
    target_noise: float, samples: Sequence[int], noise_by_samples: Sequence[float]
) -> float:
    """Return the number of paths per pixel at which the noise reaches a given value.

    Noise is extrapolated in proportion to 1 / sqrt(N), from the measured number of paths N whose noise is
    nearest to the target.

    samples : measured numbers of paths N
    noise_by_samples : noise for each of `samples`
    """
    nearest = int(np.abs(np.log(np.divide(noise_by_samples, target_noise))).argmin())
    return float(samples[nearest] * (noise_by_samples[nearest] / target_noise) ** 2)


def _signal_energy(mean_image: MeanImage, mask: Mask) -> float:
    """Return the sum of squares of a picture within a mask, minus the part that is due to noise."""
    return float((mean_image.image**2 - mean_image.variance)[mask].sum())


def _reference_mean_image(reference: PathTraced) -> MeanImage:
    return MeanImage(reference.image.astype(np.float64), reference.variance.astype(np.float64))


def _dermis_row(scene_renders: SceneRenders, variant_name: str, mask: Mask) -> RendererRow:
    frames, reference = scene_renders.ours[variant_name], scene_renders.reference
    error = relative_rmse(frames.image, reference.image, mask, reference.variance)
    energy = energy_ratio(frames.image, reference.image, mask, reference.variance)
    times = statistics.median(frames.seconds), statistics.median(frames.core_seconds)
    return RendererRow("dermis", variant_name, *times, 0.0, *error, *energy)


def _time_ratios(renderer_row: RendererRow, dermis_row: RendererRow) -> dict[str, float]:
    """Return the ratios of a renderer's elapsed and CPU times to the times of dermis [-]."""
    assert (
        renderer_row.seconds and renderer_row.core_seconds and dermis_row.seconds and dermis_row.core_seconds
    )
    return {
        "ratio": renderer_row.seconds / dermis_row.seconds,
        "core_ratio": renderer_row.core_seconds / dermis_row.core_seconds,
    }


def _mitsuba_row(scene_renders: SceneRenders, mask: Mask) -> RendererRow:
    reference = scene_renders.reference
    energy = _signal_energy(_reference_mean_image(reference), mask)
    noise = float(np.sqrt(reference.variance[mask].sum(dtype=np.float64) / energy))
    setting = _samples_text(reference.samples)
    times = reference.seconds, scene_renders.reference_core_seconds
    return RendererRow("Mitsuba, volpathmis", setting, *times, noise, None, None, None, None)


def _cycles_rows(
    scene_renders: SceneRenders, subsurface_method: str, mean_image: MeanImage, mask: Mask
) -> list[RendererRow]:
    """Return the rows for a Cycles method: one for each number of paths, and one for the mean image.

    The errors of the mean image are corrected for its noise.

    subsurface_method : method of Cycles, a key of `SceneRenders.cycles`
    """
    reference, rows = scene_renders.reference, []
    for level in zip(*scene_renders.cycles[subsurface_method], strict=True):
        pairs = [(one.image, reference.image, mask, reference.variance) for one in level]
        error = np.mean([relative_rmse(*one) for one in pairs], axis=0).tolist()
        energy = np.mean([energy_ratio(*one) for one in pairs], axis=0).tolist()
        seconds = statistics.mean(one.seconds for one in level)
        core_seconds = statistics.mean(one.core_seconds for one in level)
        noise = pass_noise(level[0].image, level[1].image, mean_image, mask)
        setting = _samples_text(level[0].samples)
        rows.append(
            RendererRow(
                CYCLES_NAMES[subsurface_method], setting, seconds, core_seconds, noise, *error, *energy
            )
        )
    error = relative_rmse(mean_image.image, reference.image, mask, reference.variance, mean_image.variance)
    energy = energy_ratio(mean_image.image, reference.image, mask, reference.variance)
    return [
        *rows,
        RendererRow(CYCLES_NAMES[subsurface_method], "noise subtracted", None, None, 0.0, *error, *energy),
    ]


def _equal_error_costs(
    scene_renders: SceneRenders, mean_image: MeanImage, dermis_row: RendererRow, mask: Mask
) -> JsonObject:
    """Return the times that random walks in Cycles need to match the error of dermis, and to reach low noise.

    The keys of the result are "same_error" and "clean". The key "same_error" is missing if the bias of Cycles
    alone is as large as the error of dermis.

    mean_image : mean of all images rendered by Cycles with random walks
    dermis_row : row of dermis; its error against the reference is the target for Cycles
    """
    reference, levels = scene_renders.reference, list(zip(*scene_renders.cycles["random-walk"], strict=True))
    bias = relative_rmse(
        mean_image.image, reference.image, mask, reference.variance, mean_image.variance
    ).value
    samples = [level[0].samples for level in levels]
    noises = [pass_noise(one.image, other.image, mean_image, mask) for one, other in levels]
    sample_counts = {"clean": samples_for_noise(LOW_NOISE_TARGET, samples, noises)}
    assert dermis_row.relrmse is not None
    if dermis_row.relrmse > bias:
        # Errors are relative to the reference, noise to the method's own mean.
        to_mean = np.sqrt(
            _signal_energy(_reference_mean_image(reference), mask) / _signal_energy(mean_image, mask)
        )
        noise = float(to_mean * np.sqrt(dermis_row.relrmse**2 - bias**2))
        sample_counts["same_error"] = samples_for_noise(noise, samples, noises)
    return {goal: _cycles_cost(count, levels[-1], dermis_row) for goal, count in sample_counts.items()}


def _cycles_cost(
    paths_per_pixel: float, measured_passes: Sequence[CyclesPass], dermis_row: RendererRow
) -> dict[str, float]:
    """Return the elapsed time of Cycles for a number of paths per pixel, and ratios to the times of dermis.

    Ratios are given for elapsed and for CPU times.

    measured_passes : images rendered by Cycles, from which the mean time per path is taken
    """
    seconds = paths_per_pixel * statistics.mean(one.seconds / one.samples for one in measured_passes)
    core_seconds = paths_per_pixel * statistics.mean(
        one.core_seconds / one.samples for one in measured_passes
    )
    assert dermis_row.seconds is not None and dermis_row.core_seconds is not None
    ratios = {"ratio": seconds / dermis_row.seconds, "core_ratio": core_seconds / dermis_row.core_seconds}
    return {"samples": paths_per_pixel, "seconds": seconds, **ratios}


def _energy_corrected_error(scene_renders: SceneRenders, variant_name: str, mask: Mask) -> float:
    """Return the relative RMSE of an image by dermis, after it is given the brightness of the reference [-].

    Each channel is scaled so that its sum within the mask is that of the reference.

    variant_name : name of the settings of dermis, a key of `DERMIS_VARIANTS`
    """
    reference, image = scene_renders.reference, scene_renders.ours[variant_name].image.astype(np.float64)
    scale = reference.image[mask].sum(axis=0, dtype=np.float64) / image[mask].sum(axis=0)
    return relative_rmse(image * scale, reference.image, mask, reference.variance).value


def _samples_text(samples: int) -> str:
    return f"{samples} paths per pixel"
