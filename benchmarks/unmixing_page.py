"""Writes docs/fit.md from what `unmixing.py`, `widths.py` and `fitting.py` measured."""

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

_TRUE_STRENGTH = 1.0  # of the surface of all faces that are fitted, as fitting.py has them


def main() -> None:
    """Write the page."""
    with atomic_file(PAGE) as trial:
        trial.write_text(page(*figures()), encoding="utf-8")


def figures() -> tuple[JsonObject, JsonObject]:
    """What was measured of unmixing, and of widths."""
    told, widths = (json.loads(path.read_text("utf-8")) for path in (RESULTS, WIDTHS))
    return told, widths


def page(told: JsonObject, widths: JsonObject) -> str:
    """The page's text."""
    text = TEXT.read_text("utf-8")
    tables = {"known": _known(told), "mistaken": _mistaken(told), "counted": _counted(told)}
    tables["fitting"] = _fitting(json.loads(FITTED.read_text("utf-8")))
    tables |= {
        "shading": _shading(told["shading"]),
        "speed": _speed(*(told[name] for name in ("speed", "speed_gpu") if name in told)),
    }
    tables |= {"supplied": _supplied(told["supplied"]), "borders": _borders(widths), "grid": _grid(widths)}
    for name, table in tables.items():
        text = text.replace(f"<!-- {name} -->", table)
    return text


def _known(told: JsonObject) -> str:
    heads = (
        "epidermis [mm]",
        "melanin",
        "skins",
        "without noise: melanin, blood, CIEDE2000",
        "1 % noise: melanin",
        "blood",
        "its bound",
        "RMS over the bound",
        "RMS over what the map states",
    )
    rows = []
    for mm, bands in told["known"].items():
        for one in bands:
            low, high = one["melanin"]
            plain = f"{_percent(one['plain_melanin'])}, {_percent(one['plain_blood'])}, {one['delta_e']:.3f}"
            noisy = (_percent(one[key]) for key in ("melanin_error", "blood_error", "blood_bound"))
            over = (f"{one[key]:.2f}" for key in ("blood_over_bound", "blood_over_stated"))
            rows.append((mm, f"{low:g} to {high:g}", one["skins"], plain, *noisy, *over))
    return _table(heads, rows)


def _mistaken(told: JsonObject) -> str:
    heads = "the skin is", "oxygen", "melanin found over true", "blood found over true", "CIEDE2000 left"
    words = {"none": "held", "oxygen": "found too"}
    rows = [
        (name, words[third], f"{one['melanin']:.2f}", f"{one['blood']:.2f}", f"{one['delta_e']:.2f}")
        for name, both in told["mistaken"].items()
        for third, one in both.items()
    ]
    return _table(heads, rows)


def _counted(told: JsonObject) -> str:
    heads = "melanin", "found", "blood", "found", "CIEDE2000 left", "of the true skin's colour by diffusion"
    rows = [
        (
            one["melanin"],
            f"{one['found_melanin']:.3g}",
            one["blood"],
            f"{one['found_blood']:.3g}",
            f"{one['delta_e']:.2f}",
            f"{one['delta_e_forward']:.2f}",
        )
        for one in told["counted"]
    ]
    return _table(heads, rows)


def _shading(told: JsonObject) -> str:
    rows = [
        (words, _percent(told[key]["melanin"]), _percent(told[key]["blood"]))
        for key, words in (("kept", "left in the colours"), ("divided", "found and divided by"))
    ]
    light = (
        f"The light varies by {_percent(told['light'])}; {_percent(told['left'])} of it is left afterwards.\n"
    )
    return _table(("light", "melanin off by (median)", "blood"), rows) + "\n" + light


def _supplied(told: Sequence[JsonObject]) -> str:
    heads = "melanin", "skins", "CIEDE2000 of the colour", "left when found", "melanin off by", "blood"
    rows = [
        (
            "{:g} to {:g}".format(*one["melanin"]),
            one["skins"],
            f"{one['delta_e_forward']:.2f}",
            f"{one['delta_e']:.2f}",
            _percent(one["melanin_error"]),
            _percent(one["blood_error"]),
        )
        for one in told
    ]
    return _table(heads, rows)


def _borders(told: JsonObject) -> str:
    heads = "media", "weights of", "mean error", "worst", "light in all", "white skin's light"
    rows = [
        (name, rule, *(_percent(one[key]) for key in ("rms", "worst", "energy", "white")))
        for name, pair in told["pairs"].items()
        for rule, one in pair["rules"].items()
    ]
    return _table(heads, rows)


def _grid(told: JsonObject) -> str:
    words = {"one_profile": "one profile, at the middle", "mixed": "three, mixed by the map"}
    rows = [(words[key], *map(_percent, told["grid"][key])) for key in words]
    return _table(("", "red", "green", "blue"), rows)


def _speed(*machines: JsonObject) -> str:
    rows = [
        (f"{side} x {side}", *(f"{told[side]:.3g}" for told in machines))
        for side in machines[0]
        if side != "adapter"
    ]
    return _table(("texels", *(f"{told['adapter']} [ms]" for told in machines)), rows)


def _fitting(told: JsonObject) -> str:
    heads = "pictures", "number", "median error", "90 %", "worst", "bias (median)"
    rows = [
        row
        for key, words in (("own", "our own frames"), ("traced", "path-traced"))
        for row in _errors(told[key], f"{len(told[key])} {words}")
    ]
    seconds = statistics.median(one["seconds"] for one in told["traced"])
    busy = statistics.median(one["processor_seconds"] for one in told["traced"])
    size = f"{told['side']} x {told['side']} pixels, {told['samples']} paths a pixel"
    took = f"{told['adapter']}: {seconds:.3g} s for a fit in the median, {busy:.3g} s of processor time"
    return _table(heads, rows) + f"\n{size}, fitted at 128 across. {took}.\n\n{_stated(told['traced'])}"


def _errors(cases: Sequence[JsonObject], words: str) -> list[tuple[str, ...]]:
    """Rows of the errors of each number."""
    rows = []
    for name in ("melanin", "blood", "roughness", "rho_s"):
        pairs = [(one["rho_s"], _TRUE_STRENGTH) if name == "rho_s" else _pair(one[name]) for one in cases]
        shares = name in ("melanin", "blood")
        off = [a / b - 1.0 if shares else a - b for a, b in pairs]
        told = _percent if shares else _thousandths
        rows.append((words, name, *_spread([abs(x) for x in off], told), told(statistics.median(off))))
    turns = [one["sun_degrees"] for one in cases]
    return [*rows, (words, "direction of the sun", *_spread(turns, lambda x: f"{x:.1f} degrees"), "")]


def _pair(one: JsonObject) -> tuple[float, float]:
    return one["found"], one["true"]


def _stated(cases: Sequence[JsonObject]) -> str:
    """How far off pigments are over the deviations that the fits state."""
    words = []
    for name in ("melanin", "blood"):
        over = [math.log(a / b) / one[name]["relative_sd"] for one in cases for a, b in [_pair(one[name])]]
        within = sum(abs(x) < 2.0 for x in over) / len(over)
        rms = math.sqrt(statistics.fmean(x * x for x in over))
        words.append(f"{name} {rms:.1f} times (RMS; within twice of it in {_percent(within)} of the faces)")
    return f"Errors of path-traced faces over the stated standard deviations: {', '.join(words)}.\n"


def _thousandths(value: float) -> str:
    return f"{value:.3f}"


def _spread(values: Sequence[float], told: Callable[[float], str]) -> tuple[str, str, str]:
    ordered = sorted(values)
    most = ordered[math.ceil(0.9 * len(ordered)) - 1]
    return told(statistics.median(ordered)), told(most), told(ordered[-1])


def _percent(share: float) -> str:
    return "over 300 %" if share > 3.0 else f"{100.0 * share:.{2 if share < 0.995 else 3}g} %"


def _table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines) + "\n"


if __name__ == "__main__":
    run_script(main)
