"""The peers' figures as Markdown."""

from __future__ import annotations

from typing import Any

GOAL = 50.0
_COLUMNS = ("renderer", "", "seconds", "noise", "relative RMSE", "energy ratio")


def scene_text(told: dict[str, Any]) -> str:
    """The table of one scene, and what follows from it."""
    head = f"| {' | '.join(_COLUMNS)} |\n|{'---|' * len(_COLUMNS)}"
    table = [head, *(_line(row) for row in told["rows"])]
    return "\n".join([*table, "", *(f"- {sentence}" for sentence in _sentences(told))])


def place_text(report: dict[str, Any]) -> str:
    """Where and with what it was measured, in one line."""
    versions = ", ".join(f"{name} {version}" for name, version in report["versions"].items())
    side = report["plan"]["side"]
    where = f"{report['cpu']}, {report['cores']} cores; ours on {report['adapter']}"
    return f"{report['date']}, {side}x{side}, {where}; {versions}"


def _line(row: dict[str, Any]) -> str:
    seconds = "-" if row["seconds"] is None else f"{row['seconds']:.3g}"
    noise = f"{row['noise']:.1%}" if row["noise"] > 0 else "-"
    cells = (
        row["renderer"],
        row["setting"],
        seconds,
        noise,
        _value(row, "relrmse"),
        _value(row, "energy_ratio"),
    )
    return f"| {' | '.join(cells)} |"


def _value(row: dict[str, Any], name: str) -> str:
    return "-" if row[name] is None else f"{row[name]:.4f} ± {row[name + '_se']:.4f}"


def _sentences(told: dict[str, Any]) -> list[str]:
    said = [_longer(setting, found) for setting, found in told.get("as_near", {}).items()]
    right = "; ".join(f"{name} {error:.3f}" for name, error in told["ours_energy_put_right"].items())
    said.append(f"Ours, each channel scaled to the truth's energy: {right}.")
    said += [
        f"The {name} take {ratio['ratio']:.2f} times as long as the first of ours, "
        f"{ratio['core_ratio']:.2f} times by the cores' time."
        for name, ratio in told.get("published", {}).items()
    ]
    if "burley_against_random_walk" in told:
        said.append(_burley(told))
    return said + [f"Left out: {name}. {why}" for name, why in told["left_out"].items()]


def _longer(setting: str, found: dict[str, dict[str, float]]) -> str:
    clean = f"to 5 % noise {_times(found['clean'])}"
    if "same_error" not in found:
        return f"{setting}: Cycles' random walk never comes as near, for its own bias is greater; {clean}."
    same = found["same_error"]
    reached = "reached" if same["ratio"] >= GOAL else "not reached"
    return (
        f"{setting}: Cycles' random walk comes as near in {_times(same)}, goal {GOAL:.0f} {reached}; {clean}."
    )


def _times(found: dict[str, float]) -> str:
    """Time, paths, and how many of our frames go into it by the clock and by the cores' own time."""
    spent = f"{found['seconds']:.3g} s ({found['samples']:.0f} paths a pixel)"
    return (
        f"{spent}: {_short(found['ratio'])} times our frame, {_short(found['core_ratio'])} by the cores' time"
    )


def _short(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.1f}"


def _burley(told: dict[str, Any]) -> str:
    """How far Burley is from the walk that it stands for, and ours from the paths that it stands for."""
    theirs, error = told["burley_against_random_walk"]
    ours = {
        row["setting"]: row["relrmse"]
        for row in told["rows"]
        if row["setting"] in told["ours_energy_put_right"]
    }
    each = "; ".join(
        f"{name} {found:.4f}, {'reached' if found <= theirs else 'not reached'}"
        for name, found in ours.items()
    )
    return (
        f"Burley's profile is {theirs:.4f} ± {error:.4f} from the random walk; ours shall be no farther "
        f"from path tracing: {each}."
    )
