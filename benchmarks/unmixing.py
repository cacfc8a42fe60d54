"""Measure how accurately melanin and blood of skin are estimated.

The input colours of known skins are computed by layered diffusion, without the table that unmixing uses, or
by Monte Carlo; `unmixing_page.py` writes docs/fit.md from the results.
"""

from __future__ import annotations

import json
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from dermis.apps.inverse.unmixing.device_unmixer import Unmixer
from dermis.apps.inverse.unmixing.skin_model import (
    ExtraUnknown,
    SkinModel,
    inverse_variances,
    skin_model,
    solve_pigments,
)
from dermis.apps.inverse.unmixing.unmix import unmix
from dermis.apps.truths.slab_mc import monte_carlo_profile
from dermis.apps.validation.pages import JsonObject, write_results
from dermis.base.command_line import run_script
from dermis.base.console import print_lines
from dermis.gpu import CommandList, Device, open_device
from dermis.gpu.textures import texture_from_array
from dermis.images.colour import delta_e_2000
from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters
from dermis.optics.pigments.skin import spectral_medium
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.optics.tissue import load_tissue

RESULTS = Path(__file__).parent / "results" / "unmixing.json"
Floats = NDArray[np.float64]
SKINS, TRIALS, NOISE, SEED = 200, 64, 0.01, 7
SIDES = 1024, 2048, 4096
BANDS = (0.0, 0.01, 0.05, 0.2, 0.5)
THICK_MM = 0.05, 0.25
_MELANIN, _BLOOD = (-2.5, -0.35), (-3.0, -1.0)  # ranges of the decimal logarithms
_MONTE_CARLO_PIGMENTS = ((0.005, 0.005), (0.02, 0.01), (0.06, 0.02), (0.15, 0.01), (0.3, 0.03))
_PHOTONS = 40_000
_SIDE = 192


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = RESULTS,
    adapter: str = "auto",
    speed_only: Annotated[bool, Parameter(name="--speed", negative="")] = False,
    supplied_folder: Annotated[Path | None, Parameter(name="--supplied")] = None,
) -> int:
    """Measure, and write the figures.

    Parameters
    ----------
    output:
        JSON file with the figures.
    speed_only:
        Print only the times, and write nothing.
    supplied_folder:
        Folder with spectral_srgb_diffusion.csv, colours by another program; measure only these.
    """
    results = json.loads(output.read_text("utf-8")) if output.exists() else {}
    if supplied_folder:
        write_results(output, results | {"supplied": supplied(supplied_folder)}, 4)
        return 0
    device = open_device(adapter)
    speed = {"adapter": device.adapter.name} | {str(side): speed_ms(device, side) for side in SIDES}
    if speed_only:
        print_lines(json.dumps(speed))
        return 0
    results |= {"skins": SKINS, "noise": NOISE, "photons": _PHOTONS}
    results["known"] = {str(mm): known_skin_errors(replace(DEFAULT_SKIN, epidermis_mm=mm)) for mm in THICK_MM}
    results["mistaken"] = model_error_cases()
    results["counted"] = monte_carlo_errors()
    results["shading"] = shading(adapter)
    results["speed"] = speed
    write_results(output, results, 4)
    return 0


def skins(seed: int = SEED) -> tuple[Floats, Floats]:
    """Return random melanin and blood fractions, uniform in their logarithms."""
    random = np.random.default_rng(seed)
    return 10.0 ** random.uniform(*_MELANIN, SKINS), 10.0 ** random.uniform(*_BLOOD, SKINS)


def colour_of(skin: SkinParameters) -> Floats:
    """Return the (3,) linear Rec. 709 reflectance of a skin by layered diffusion at each wavelength [-]."""
    total = diffusion_profile(spectral_medium("dj2006", skin), "layered", "layer").total
    return np.asarray((1.0 - normal_reflectance(1.4)) * total @ rgb_weights(WAVELENGTHS_NM).T)


def known_skin_errors(skin: SkinParameters) -> list[JsonObject]:
    """Return errors for skins that the model describes exactly, without and with noise, by melanin."""
    m, b = skins()
    colours = np.stack([colour_of(replace(skin, melanin=x, blood=y)) for x, y in zip(m, b, strict=True)])
    model = skin_model(skin)
    plain = solve_pigments(model, colours, 1e-3)
    random = np.random.default_rng(SEED)
    noisy = colours * (1.0 + NOISE * random.standard_normal((TRIALS, *colours.shape)))
    found = solve_pigments(model, noisy.reshape(-1, 3), NOISE)
    melanin, blood, stated = (one.reshape(TRIALS, -1) for one in (found.melanin, found.blood, found.blood_sd))
    least = bound(model, m, b, colours)
    back = model.colours(plain.melanin, plain.blood)
    rows = []
    for low, high in pairwise(BANDS):
        one = (low < m) & (m <= high)
        rms = np.sqrt(((blood - b) ** 2).mean(axis=0))
        rows.append(
            {
                "melanin": [low, high],
                "skins": int(one.sum()),
                "plain_melanin": float(np.abs(plain.melanin / m - 1.0)[one].max()),
                "plain_blood": float(np.abs(plain.blood / b - 1.0)[one].max()),
                "delta_e": float(delta_e_2000(back, colours)[one].max()),
                "melanin_error": float(np.median(np.abs(melanin / m - 1.0)[:, one])),
                "blood_error": float(np.median(np.abs(blood / b - 1.0)[:, one])),
                "blood_bound": float(np.median(least[one])),
                "blood_over_bound": float(np.median((rms / b / least)[one])),
                "blood_over_stated": float(np.median((rms / np.median(stated, axis=0))[one])),
            }
        )
    return rows


def bound(model: SkinModel, m: Floats, b: Floats, colours: Floats) -> Floats:
    """Return the least relative error of blood that noise permits without a prior: the Cramér-Rao bound."""
    found = np.stack([np.sqrt(m), np.sqrt(b), np.full(len(m), model.prior_mean)], axis=-1)
    slopes = model.evaluate(found)[1][:, :, :2]
    weighed = np.einsum("tci,tc,tcj->tij", slopes, inverse_variances(colours, NOISE), slopes)
    return np.asarray(2.0 * np.sqrt(np.linalg.inv(weighed)[:, 1, 1] / b))


def model_error_cases() -> JsonObject:
    """Return the estimates of melanin and blood if the skin differs from the assumed model."""
    cases: dict[str, dict[str, float]] = {
        "oxygen 0.6 for 0.85": {"oxygen": 0.6},
        "eumelanin 0.5 for 0.7": {"eumelanin": 0.5},
        "epidermis of 0.08 mm for 0.055": {"epidermis_mm": 0.08},
        "bloodless tissue as in [Jacques1998]": {"baseline": 1.0},
    }
    m, b = skins(SEED + 1)
    usual = (m > 0.005) & (m < 0.2) & (b > 0.003) & (b < 0.05)
    m, b = m[usual], b[usual]
    results = {}
    for name, other in cases.items():
        skin = replace(DEFAULT_SKIN, **other)
        colours = np.stack([colour_of(replace(skin, melanin=x, blood=y)) for x, y in zip(m, b, strict=True)])
        results[name] = {third: _median_errors(third, colours, m, b) for third in ("none", "oxygen")}
    return results


def _median_errors(third: ExtraUnknown, colours: Floats, m: Floats, b: Floats) -> dict[str, float]:
    found = solve_pigments(skin_model(DEFAULT_SKIN, third), colours, NOISE)
    ratios = {"melanin": found.melanin / m, "blood": found.blood / b}
    left = delta_e_2000(colours, colours / found.residual)
    return {name: float(np.median(one)) for name, one in ratios.items()} | {"delta_e": float(np.median(left))}


def monte_carlo_errors() -> list[JsonObject]:
    """Return errors for skins with colours by Monte Carlo; they include the error of the diffusion model."""
    results = []
    for m, b in _MONTE_CARLO_PIGMENTS:
        pigments = {"melanin": m, "blood": b}
        tissue = load_tissue("spectral", pigments=pigments)
        colour = monte_carlo_profile(tissue.medium, tissue.rgb, _PHOTONS, seed=SEED).total[None]
        found = solve_pigments(skin_model(), colour, NOISE)
        own = skin_model().colours(np.array([m]), np.array([b]))
        results.append(
            {
                "melanin": m,
                "blood": b,
                "found_melanin": float(found.melanin[0]),
                "found_blood": float(found.blood[0]),
                "delta_e": float(delta_e_2000(colour / found.residual, colour)[0]),
                "delta_e_forward": float(delta_e_2000(own, colour)[0]),
            }
        )
    return results


def supplied(folder: Path) -> list[JsonObject]:
    """Return the median errors for skins with colours computed by another program, by bands of melanin."""
    table = np.genfromtxt(
        folder / "spectral_srgb_diffusion.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    m, b = (table[name].astype(np.float64) for name in ("f_mel", "f_blood"))
    colours = np.stack([table[f"lin_{channel}"] for channel in "RGB"], axis=-1)
    model = skin_model(SkinParameters(eumelanin=1.0, oxygen=0.75, epidermis_mm=0.06, baseline=1.0))
    found, forward = solve_pigments(model, colours, NOISE), delta_e_2000(model.colours(m, b), colours)
    left = delta_e_2000(colours / found.residual, colours)
    results = []
    for low, high in pairwise(BANDS):
        one = (low < m) & (m <= high) & (b > 0.0)
        if one.any():
            results.append(
                {
                    "melanin": [low, high],
                    "skins": int(one.sum()),
                    "delta_e_forward": float(np.median(forward[one])),
                    "delta_e": float(np.median(left[one])),
                    "melanin_error": float(np.median(np.abs(found.melanin[one] / m[one] - 1.0))),
                    "blood_error": float(np.median(np.abs(found.blood[one] / b[one] - 1.0))),
                }
            )
    return results


def shading(adapter: str) -> JsonObject:
    """Return errors for a synthetic map under uneven light, without and with an estimate of the shading."""
    random = np.random.default_rng(SEED)
    fields = [gaussian_filter(random.standard_normal((_SIDE, _SIDE)), s, mode="wrap") for s in (3, 4, 40)]
    m, b, light = (one / one.std() for one in fields)
    m, b, light = 0.03 * np.exp(0.3 * m), 0.01 * np.exp(0.3 * b), np.exp(0.2 * light)
    colours = skin_model().colours(m.ravel(), b.ravel()).reshape(_SIDE, _SIDE, 3) * light[..., None]
    colours *= 1.0 + NOISE * random.standard_normal(colours.shape)
    colours = np.clip(colours, 0.0, 1.0)
    results: JsonObject = {"light": float(np.log(light).std())}
    for name, removes_shading in (("kept", False), ("divided", True)):
        found = unmix(colours, shading=removes_shading, adapter=adapter)
        results[name] = {
            "melanin": float(np.median(np.abs(found.melanin / m - 1.0))),
            "blood": float(np.median(np.abs(found.blood / b - 1.0))),
        }
        if found.shading is not None:
            results["left"] = float((np.log(light) - np.log(found.shading)).std())
    return results


def speed_ms(device: Device, side: int) -> float:
    """Return the least device or CPU time of five passes over a square picture [ms]."""
    random = np.random.default_rng(SEED)
    m, b = gaussian_filter(random.standard_normal((2, 256, 256)), (0, 2, 2))
    share = np.stack([0.05 * np.exp(2 * m), 0.01 * np.exp(2 * b)]).reshape(2, -1)
    tile = skin_model().colours(*np.clip(share, 0.0, 1.0)).reshape(256, 256, 3)
    tiled = np.ones((side, side, 4), np.float32)
    tiled[..., :3] = np.tile(tile, (side // 256, side // 256, 1))
    unmixer = Unmixer(device, skin_model(), NOISE)
    colours = texture_from_array(device, tiled, "rgba32float")
    times = []
    for _ in range(6):
        started = time.process_time()
        frame = CommandList(device)
        unmixer.record(frame, colours)
        frame.submit()
        frame.wait()
        stages = frame.stage_ms()
        times.append(stages["unmix"] if stages else 1e3 * (time.process_time() - started))
    return float(min(times[1:]))


if __name__ == "__main__":
    run_script(main)
