"""Measure frame times, or memory over minutes, of an exported page in headless Chromium."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from dermis.apps.validation.pages import chromium_page
from dermis.base.command_line import run_script

if TYPE_CHECKING:
    from playwright.sync_api import Page

SOFTWARE = ["--use-webgpu-adapter=swiftshader"]
FLAGS = ["--no-sandbox", "--enable-unsafe-webgpu", "--js-flags=--expose-gc", "--enable-precise-memory-info"]
HARDWARE = ["--enable-features=Vulkan", "--ignore-gpu-blocklist", "--use-angle=vulkan"]
FRAMES = 4  # timed frames of each kind
STATE = "document.documentElement.dataset.state"
TURN_IN_MOTION = "async () => { dermis.state.yaw += 0.02; dermis.touch(); await dermis.idle(); }"
TURN_AND_REST = "async () => { dermis.state.yaw += 0.02; dermis.rest(); await dermis.idle(); }"


def processor_s() -> float:
    """Return the CPU time of all processes of the browser [s]."""
    ticks = 0
    for folder in Path("/proc").iterdir():
        try:
            words = (folder / "stat").read_text().rpartition(")")[2].split()
            command = (folder / "cmdline").read_bytes()
        except OSError:
            continue
        if b"chrom" in command and folder.name.isdigit():
            ticks += int(words[11]) + int(words[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def timed(page: Page, script: str, count: int) -> tuple[float, float]:
    """Return wall time and CPU time per run of a script in the page [s]."""
    began, used = time.perf_counter(), processor_s()
    for _ in range(count):
        page.evaluate(script)
    return (time.perf_counter() - began) / count, (processor_s() - used) / count


def resident_mb() -> float:
    """Return the memory of all processes of the browser; shared memory counts once in total [MB]."""
    total = 0
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and b"chrom" in (folder / "cmdline").read_bytes():
                lines = (folder / "smaps_rollup").read_text().splitlines()
                total += next(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
        except OSError:
            continue
    return total / 1e3


def turn_head(page: Page, minutes: float) -> None:
    """Turn the head for some minutes, and print the memory each minute."""
    began, frames, minute = time.monotonic(), 0, 0
    while minute <= minutes:
        page.evaluate(TURN_IN_MOTION)
        frames += 1
        if time.monotonic() - began >= 60 * minute:
            page.evaluate("window.gc && gc()")
            heap = page.evaluate("performance.memory.usedJSHeapSize") / 1e6
            sys.stdout.write(
                f"{minute} min, {frames} frames: heap {heap:.1f} MB, browser {resident_mb():.0f} MB\n"
            )
            sys.stdout.flush()
            minute += 1


def main(
    file: Path,
    side: int = 512,
    form: Literal["gpu", "software", ""] = "",
    *,
    gpu: Annotated[bool, Parameter(negative="")] = False,
    minutes: float = 0.0,
) -> None:
    """Open the page and turn the head.

    Parameters
    ----------
    file:
        Exported page.
    side:
        Side of the viewport [pixel].
    form:
        Form of the frame. [default: chosen by the page]
    gpu:
        Use the GPU of the machine if Chromium can.
    minutes:
        Turn the head for this time instead, and print the memory of page and browser each minute [min].
    """
    with chromium_page(side, FLAGS + (HARDWARE if gpu else SOFTWARE)) as page:
        began, used = time.perf_counter(), processor_s()
        page.goto(file.resolve().as_uri() + (f"#form={form}" if form else ""))
        page.wait_for_function(f"() => {STATE} && {STATE} !== 'loading'", timeout=300_000)
        first = time.perf_counter() - began, processor_s() - used
        if minutes:
            turn_head(page, minutes)
            return
        rows = {"first picture": first, "frame at rest, camera turned": timed(page, TURN_AND_REST, FRAMES)}
        rows["frame in motion"] = timed(page, TURN_IN_MOTION, FRAMES)
        size = page.evaluate("dermis.player.frame.size")
        for name, (wall, processor) in rows.items():
            sys.stdout.write(f"{name}: {wall:.2f} s wall time, {processor:.2f} s CPU time\n")
        sys.stdout.write(
            f"{file.stat().st_size / 1e6:.1f} MB, picture {size}, load {os.getloadavg()[0]:.1f}\n"
        )


if __name__ == "__main__":
    run_script(main)
