"""What `benchmarks/viewer.py` found, as Markdown."""

from __future__ import annotations

from typing import Any

_SECTIONS = ("speed", "delay", "page", "memory")


def tables(found: dict[str, Any]) -> str:
    """All of it that there is."""
    parts = [_title(found), _speed(found), _delay(found)]
    if "samples" in found.get("memory", {}):
        parts.append(_memory(found["memory"]))
    ended = [
        f"{name} ended early: {found[name]['ended']}" for name in _SECTIONS if "ended" in found.get(name, {})
    ]
    return "\n\n".join([*parts, *ended])


def _figures(found: dict[str, Any], section: str) -> dict[str, Any]:
    """A section's, without the reason why it ended."""
    return {name: one for name, one in found.get(section, {}).items() if name != "ended"}


def _title(found: dict[str, Any]) -> str:
    plan = found["plan"]
    size = " x ".join(map(str, plan["size"]))
    what = f"{plan['head']}, {size}, atlas {plan['atlas']}, samples {plan['samples']}"
    return f"{found['adapter']}, {what}, {found['date'][:10]}"


def _speed(found: dict[str, Any]) -> str:
    rows = [
        "| motion | frames/s | frame [ms] | 95 % within, longest [ms] | processor time [ms] | stages |",
        "|---|---|---|---|---|---|",
    ]
    for name, one in _figures(found, "speed").items():
        numbers = f"{one['frames_per_s']:.1f} | {one['frame_ms']:.1f} | {_late(one)}"
        rows.append(f"| {name} | {numbers} | {one['processor_ms']:.1f} | {', '.join(one['stages'])} |")
    page = _figures(found, "page")
    for name in ("camera", "light", "melanin"):
        if name in page:
            one = page[name]
            numbers = f"{one['frames_per_s']:.1f} | | {_late(one)}"
            rows.append(f"| {name}, in the page | {numbers} | | {one['kilobytes']:.0f} kB a frame |")
    return "\n".join(rows)


def _late(one: dict[str, float]) -> str:
    return f"{one['late_frame_ms']:.1f}, {one['longest_frame_ms']:.1f}"


def _delay(found: dict[str, Any]) -> str:
    rows = ["| latency from a move to the picture | median [ms] | 95 % within [ms] |", "|---|---|---|"]
    page, several = _figures(found, "page"), _figures(found, "delay")
    if "delay" in page:
        several["in the page, from rest"] = page["delay"]
    for name, one in several.items():
        rows.append(f"| {name} | {one['median_ms']:.1f} | {one['late_ms']:.1f} |")
    if "encoding" in page:
        coding = page["encoding"]
        rows.append(
            f"| of which JPEG, and PNG when still | {coding['jpeg_ms']:.1f}, {coding['png_ms']:.1f} | |"
        )
    return "\n".join(rows)


def _memory(memory: dict[str, Any]) -> str:
    taken = memory["samples"]
    size = " x ".join(map(str, memory["plan"]["size"]))
    rows = [
        f"{size}, atlas {memory['plan']['atlas']}:",
        "",
        "| after changes | minutes | process [MB] | textures and buffers [MB] |",
        "|---|---|---|---|",
    ]
    for k in sorted({0, *(round(part * (len(taken) - 1) / 8) for part in range(9))}):
        one = taken[k]
        numbers = f"{one['s'] / 60:.1f} | {one['resident_mb']:.0f} | {one['device_mb']:.1f}"
        rows.append(f"| {one['changes']} | {numbers} |")
    slopes = memory["resident_mb_per_1000"], memory["device_mb_per_1000"]
    rows.append(f"\nSecond half: {slopes[0]:+.1f} MB and {slopes[1]:+.1f} MB for 1000 changes.")
    return "\n".join(rows)
