"""Write docs/fit.md from the results of `unmixing.py`, `widths.py` and `fitting.py`."""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Callable, Sequence
from pathlib import Path

from dermis.apps.validation.pages import JsonObject
from dermis.base.atomic_write import atomic_file
from dermis.base.command_line import run_script

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "fit.md"
TEXT = ROOT / "docs" / "templates" / "fit.md"
RESULTS = ROOT / "benchmarks" / "results" / "unmixing.json"
WIDTHS = RESULTS.with_name("widths.json")
FITTED = ROOT / "benchmarks" / "results" / "fitting.json"

_TRUE_STRENGTH = 1.0  # specular strength of all fitted faces, as in fitting.py


def main() -> None:
    """Write the page."""
    with atomic_file(PAGE) as trial:
        trial.write_text(page(*figures()), encoding="utf-8")


def figures() -> tuple[JsonObject, JsonObject]:
    """Return the figures of unmixing and of widths."""
    results, widths = (json.loads(path.read_text("utf-8")) for path in (RESULTS, WIDTHS))
    return results, widths


def page(results: JsonObject, widths: JsonObject) -> str:
    """Return the text of the page."""
    text = TEXT.read_text("utf-8")
    tables = {
        "known": _known_skin_table(results),
        "mistaken": _mistaken(results),
        "counted": _counted(results),
    }
    tables["fitting"] = _fitting(json.loads(FITTED.read_text("utf-8")))
    tables |= {
        "shading": _shading(results["shading"]),
        "speed": _speed(*(results[name] for name in ("speed", "speed_gpu") if name in results)),
    }
    tables |= {"supplied": _supplied(results["supplied"]), "borders": _borders(widths), "grid": _grid(widths)}
    for name, table in tables.items():
        text = text.replace(f"<!-- {name} -->", table)
    return text


def _known_skin_table(results: JsonObject) -> str:
    heads = (
        "epidermis [mm]",
        "melanin",
        "skins",
        "without noise: melanin, blood, CIEDE2000",
        "1 % noise: melanin",
        "blood",
        "bound of blood",
        "RMS over the bound",
        "RMS over the stated deviation",
    )
    rows = []
    for mm, bands in results["known"].items():
        for one in bands:
            low, high = one["melanin"]
            plain = f"{_percent(one['plain_melanin'])}, {_percent(one['plain_blood'])}, {one['delta_e']:.3f}"
            noisy = (_percent(one[key]) for key in ("melanin_error", "blood_error", "blood_bound"))
            over = (f"{one[key]:.2f}" for key in ("blood_over_bound", "blood_over_stated"))
            rows.append((mm, f"{low:g} to {high:g}", one["skins"], plain, *noisy, *over))
    return _table(heads, rows)


def _mistaken(results: JsonObject) -> str:
    heads = "true skin", "oxygen", "melanin, found / true", "blood, found / true", "remaining CIEDE2000"
    words = {"none": "fixed", "oxygen": "estimated"}
    rows = [
        (name, words[third], f"{one['melanin']:.2f}", f"{one['blood']:.2f}", f"{one['delta_e']:.2f}")
        for name, both in results["mistaken"].items()
        for third, one in both.items()
    ]
    return _table(heads, rows)


def _counted(results: JsonObject) -> str:
    heads = "melanin", "found", "blood", "found", "remaining CIEDE2000", "CIEDE2000 of diffusion"
    rows = [
        (
            one["melanin"],
            f"{one['found_melanin']:.3g}",
            one["blood"],
            f"{one['found_blood']:.3g}",
            f"{one['delta_e']:.2f}",
            f"{one['delta_e_forward']:.2f}",
        )
        for one in results["counted"]
    ]
    return _table(heads, rows)


def _shading(results: JsonObject) -> str:
    rows = [
        (words, _percent(results[key]["melanin"]), _percent(results[key]["blood"]))
        for key, words in (("kept", "not corrected"), ("divided", "estimated and divided out"))
    ]
    varies, left = _percent(results["light"]), _percent(results["left"])
    light = f"The light varies by {varies}; {left} remain after the correction.\n"
    return _table(("light", "median error of melanin", "of blood"), rows) + "\n" + light


def _supplied(results: Sequence[JsonObject]) -> str:
    colour = "CIEDE2000 of the colour", "remaining after the fit"
    heads = "melanin", "skins", *colour, "melanin error", "of blood"
    rows = [
        (
            "{:g} to {:g}".format(*one["melanin"]),
            one["skins"],
            f"{one['delta_e_forward']:.2f}",
            f"{one['delta_e']:.2f}",
            _percent(one["melanin_error"]),
            _percent(one["blood_error"]),
        )
        for one in results
    ]
    return _table(heads, rows)


def _borders(results: JsonObject) -> str:
    heads = "media", "weights of", "mean error", "worst error", "error of the total", "energy, white skin"
    rows = [
        (name, rule, *(_percent(one[key]) for key in ("rms", "worst", "energy", "white")))
        for name, pair in results["pairs"].items()
        for rule, one in pair["rules"].items()
    ]
    return _table(heads, rows)


def _grid(results: JsonObject) -> str:
    words = {"one_profile": "one profile, at the middle", "mixed": "three, mixed by the map"}
    rows = [(words[key], *map(_percent, results["grid"][key])) for key in words]
    return _table(("", "red", "green", "blue"), rows)


def _speed(*machines: JsonObject) -> str:
    rows = [
        (f"{side} x {side}", *(f"{results[side]:.3g}" for results in machines))
        for side in machines[0]
        if side != "adapter"
    ]
    return _table(("texels", *(f"{results['adapter']} [ms]" for results in machines)), rows)


def _fitting(results: JsonObject) -> str:
    heads = "pictures", "parameter", "median error", "90 %", "worst", "bias (median)"
    rows = [
        row
        for key, words in (("own", "rendered by dermis"), ("traced", "path-traced"))
        for row in _errors(results[key], f"{len(results[key])} {words}")
    ]
    seconds = statistics.median(one["seconds"] for one in results["traced"])
    busy = statistics.median(one["processor_seconds"] for one in results["traced"])
    size = f"{results['side']} x {results['side']} pixels, {results['samples']} paths per pixel"
    took = f"{results['adapter']}: a fit takes {seconds:.3g} s (median), {busy:.3g} s of processor time"
    text = f"{size}, fitted at a width of 128 pixels. {took}.\n\n"
    errors = f"relative to the stated standard deviations: {_stated(results['traced'])}"
    text += f"Errors of path-traced faces {errors}.\n"
    if people := results.get("people"):
        text += (
            f"\nThe same of {len(people)} people with measured pigments, rendered by this package, of whom "
        )
        text += f"the fit knows neither oxygen nor thickness of the epidermis: {_stated(people)}.\n"
    else:
        text += (
            "\nThese figures are of people and of a skin model before the comparison with measured people.\n"
        )
    return f"{_table(heads, rows)}\n{text}"


def _errors(cases: Sequence[JsonObject], words: str) -> list[tuple[str, ...]]:
    """Return the table rows with the errors of each estimated number."""
    rows = []
    for name in ("melanin", "blood", "roughness", "rho_s"):
        pairs = [(one["rho_s"], _TRUE_STRENGTH) if name == "rho_s" else _pair(one[name]) for one in cases]
        is_relative = name in ("melanin", "blood")
        off = [a / b - 1.0 if is_relative else a - b for a, b in pairs]
        text_of = _percent if is_relative else _thousandths
        rows.append((words, name, *_spread([abs(x) for x in off], text_of), text_of(statistics.median(off))))
    turns = [one["sun_degrees"] for one in cases]
    return [*rows, (words, "direction of the sun", *_spread(turns, lambda x: f"{x:.1f} degrees"), "")]


def _pair(one: JsonObject) -> tuple[float, float]:
    return one["found"], one["true"]


def _stated(cases: Sequence[JsonObject]) -> str:
    """Return the errors of the pigments relative to the standard deviations stated by the fits."""
    words = []
    for name in ("melanin", "blood"):
        over = [math.log(a / b) / case[name]["relative_sd"] for case in cases for a, b in [_pair(case[name])]]
        one, two = (_percent(sum(abs(x) < limit for x in over) / len(over)) for limit in (1.0, 2.0))
        rms = math.sqrt(statistics.fmean(x * x for x in over))
        words.append(f"{name} {rms:.2f} (RMS; within one deviation for {one} of the faces, two for {two})")
    return ", ".join(words)


def _thousandths(value: float) -> str:
    return f"{value:.3f}"


def _spread(values: Sequence[float], text_of: Callable[[float], str]) -> tuple[str, str, str]:
    ordered = sorted(values)
    most = ordered[math.ceil(0.9 * len(ordered)) - 1]
    return text_of(statistics.median(ordered)), text_of(most), text_of(ordered[-1])


def _percent(share: float) -> str:
    return "over 300 %" if share > 3.0 else f"{100.0 * share:.{2 if share < 0.995 else 3}g} %"


def _table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines) + "\n"


if __name__ == "__main__":
    run_script(main)
