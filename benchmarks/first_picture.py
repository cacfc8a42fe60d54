"""Time `dermis render` from the shell to the picture.

    python benchmarks/first_picture.py -o result.json

Each cold run starts with empty caches of the package and of the driver; warm runs follow it.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from dermis.base.atomic_write import atomic_file, check_output
from dermis.base.command_line import run_script
from dermis.base.console import print_json

_WARM_RUNS = 2  # after each cold run


def main(
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    head: str = "lee_perry_smith",
    atlas: tuple[int, ...] = (1024, 2048),
    adapter: str = "auto",
    runs: int = 3,
) -> int:
    """Measure, print, and write the figures if a file is given.

    Parameters
    ----------
    output:
        JSON file to write.
    head:
        A sample (under DERMIS_DATA, because a timed run downloads nothing) or a file.
    atlas:
        Sides of the atlas [texel].
    adapter:
        auto (the best), cpu (software), or part of an adapter's name.
    runs:
        Number of runs with empty caches.
    """
    if output is not None:
        check_output(output, (".json",))
    found = {f"atlas {side}": run_times(head, side, adapter, runs) for side in atlas}
    print_json({"head": head, "seconds": found})
    if output is not None:
        with atomic_file(output) as trial:
            trial.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    return 0


def run_times(head: str, side: int, adapter: str, runs: int) -> dict[str, dict[str, float]]:
    """Return the least and median time of the process with empty and with filled caches [s]."""
    cold, warm = list[float](), list[float]()
    for _ in range(runs):
        with tempfile.TemporaryDirectory() as folder:
            caches = os.environ | {"XDG_CACHE_HOME": folder, "DERMIS_CACHE": f"{folder}/dermis"}
            cold.append(run_time_s(head, side, adapter, Path(folder), caches))
            warm += [run_time_s(head, side, adapter, Path(folder), caches) for _ in range(_WARM_RUNS)]
    return {
        name: {"least": min(times), "median": statistics.median(times)}
        for name, times in (("cold", cold), ("warm", warm))
    }


def run_time_s(head: str, side: int, adapter: str, folder: Path, environment: Mapping[str, str]) -> float:
    """Return the time of one process [s]."""
    command = [sys.executable, "-m", "dermis", "render", head, "-o", str(folder / "picture.png")]
    options = ["--atlas", str(side), "--adapter", adapter]
    started = time.perf_counter()
    subprocess.run([*command, *options], check=True, stdout=subprocess.DEVNULL, env=dict(environment))
    return time.perf_counter() - started


if __name__ == "__main__":
    run_script(main)
