"""What `benchmarks/viewer.py` found, as Markdown."""

from __future__ import annotations

from typing import Any


def tables(found: dict[str, Any]) -> str:
    """All of it."""
    parts = [_speed(found), _delay(found)]
    if "memory" in found:
        parts.append(_memory(found["memory"]))
    return "\n\n".join([_title(found), *parts])


def _title(found: dict[str, Any]) -> str:
    plan = found["plan"]
    size = " x ".join(map(str, plan["size"]))
    what = f"{plan['head']}, {size}, atlas {plan['atlas']}, samples {plan['samples']}"
    return f"{found['adapter']}, {what}, {found['date'][:10]}"


def _speed(found: dict[str, Any]) -> str:
    rows = ["| what moves | frames/s | frame [ms] | processor time [ms] | stages |", "|---|---|---|---|---|"]
    for name, one in found["speed"].items():
        numbers = f"{one['frames_per_s']:.1f} | {one['frame_ms']:.0f} | {one['processor_ms']:.0f}"
        rows.append(f"| {name} | {numbers} | {', '.join(one['stages'])} |")
    for name in ("camera", "light") if "page" in found else ():
        one = found["page"][name]
        rows.append(
            f"| {name}, in the page | {one['frames_per_s']:.1f} | | | {one['kilobytes']:.0f} kB a frame |"
        )
    return "\n".join(rows)


def _delay(found: dict[str, Any]) -> str:
    rows = ["| from a move to the picture | median [ms] | 95 % within [ms] |", "|---|---|---|"]
    several = found["delay"] | ({"in the page, from rest": found["page"]["delay"]} if "page" in found else {})
    rows += [f"| {name} | {one['median_ms']:.0f} | {one['late_ms']:.0f} |" for name, one in several.items()]
    if "page" in found:
        coding = found["page"]["encoding"]
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
