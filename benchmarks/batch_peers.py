"""Compare data sets by Cycles and by dermis on one CPU: seconds and noise of an image of a new person.

Needs DERMIS_BLENDER_PYTHON, a Python interpreter with bpy. Cycles renders people written by `dermis head`,
with subsurface scattering, depth, normals and material indices. `dermis batch` renders people with hair,
brows and lashes, which the files for Cycles lack, and with labels and landmarks. Takes ten minutes on two
idle cores.
"""

from __future__ import annotations

import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from datetime import date
from importlib.metadata import version
from pathlib import Path
from statistics import mean
from typing import Annotated

from cyclopts import Parameter

from dermis.apps.truths.blender_process import blender_python
from dermis.apps.validation.pages import JsonObject, write_results
from dermis.apps.validation.peers.report import cpu_model
from dermis.base.command_line import run_script
from dermis.base.console import print_lines
from dermis.base.errors import refuse

ROOT = Path(__file__).resolve().parent
RESULTS = ROOT / "results" / "batch_peers.json"
SCRIPT = ROOT / "batch_peers_script.py"
_LONGEST_S, _DIGITS = 3600, 4


def main(
    *,
    people: int = 3,
    images: int = 24,
    side: int = 256,
    samples: str = "16,64,256",
    adapter: str = "cpu",
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = RESULTS,
) -> int:
    """Measure, print Markdown, and write the raw figures.

    Parameters
    ----------
    people:
        Number of people that Cycles renders.
    images:
        Number of images of `dermis batch`, each of a new person.
    side:
        Side of the pictures [pixel].
    samples:
        Paths per pixel, separated by commas; each with and without denoising.
    output:
        JSON file with the raw figures.
    """
    python = blender_python(None)
    settings = [
        {"name": f"{count} paths{', denoised' * clean}", "samples": int(count), "denoised": clean}
        for count in samples.split(",")
        for clean in (False, True)
    ]
    with tempfile.TemporaryDirectory(prefix="dermis-batch-peers-") as name:
        folder = Path(name)
        rows = [*_cycles(python, folder, people, side, settings), _ours(folder, images, side, adapter)]
    report = {
        "date": date.today().isoformat(),
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        "side": side,
        "versions": {"dermis": version("dermis"), "python": platform.python_version()},
        "rows": rows,
    }
    write_results(output, report, _DIGITS)
    print_lines(table(report))
    return 0


def table(report: JsonObject) -> str:
    """Return the rows as a Markdown table."""
    head = "| renderer | setting | seconds per image, wall time | CPU time | noise |\n|---|---|---|---|---|"
    return "\n".join([head, *map(_line, report["rows"])])


def _line(row: JsonObject) -> str:
    noise = f"{row['noise']:.1%}" if row["noise"] else "none"
    times = f"{row['seconds']:.3g} | {row['core_seconds']:.3g}"
    return f"| {row['renderer']} | {row['setting']} | {times} | {noise} |"


def _cycles(
    python: Path, folder: Path, people: int, side: int, settings: list[JsonObject]
) -> list[JsonObject]:
    """Return a row per setting of Cycles, including the time to load a person and build the scene."""
    for seed in range(people):
        _run([*_DERMIS, "head", "--seed", str(seed), "--size", "1024", "-o", str(folder / f"{seed}.glb")])
    plan = {"size": [side, side], "settings": settings}
    (folder / "plan.json").write_text(json.dumps(plan), encoding="utf-8")
    _run([str(python), "-I", str(SCRIPT), str(folder)])
    done = json.loads((folder / "done.json").read_text(encoding="utf-8"))
    rows = []
    for name in (setting["name"] for setting in settings):
        found = [(one["made"], one["settings"][name]) for one in done["people"]]
        clock, cores = (mean(made[k] + one["times"][k] for made, one in found) for k in (0, 1))
        noise = mean(one["noise"] for _, one in found)
        renderer = f"Cycles of Blender {done['version']}"
        rows.append(_row(renderer, name, clock, cores, noise))
    return rows


def _ours(folder: Path, images: int, side: int, adapter: str) -> JsonObject:
    """Return the row of dermis: time of a long run minus that of a run with one image, per further image."""
    spec = folder / "spec.toml"
    spec.write_text(_run([*_DERMIS, "batch", "--example"]), encoding="utf-8")
    spent = [_batch(spec, folder / f"of-{count}", count, side, adapter) for count in (1, 1, 1 + images)]
    clock, cores = ((spent[2][k] - spent[1][k]) / images for k in (0, 1))
    return _row("dermis batch", "as its example", clock, cores, 0.0)


def _batch(spec: Path, out: Path, count: int, side: int, adapter: str) -> tuple[float, float]:
    """Return wall time and CPU time of rendering a data set [s]."""
    began, worked = time.perf_counter(), _cores_s()
    size = ["--size", f"{side}x{side}", "--count", str(count), "--adapter", adapter]
    _run([*_DERMIS, "batch", str(spec), "-o", str(out), *size, "--json"])
    return time.perf_counter() - began, _cores_s() - worked


def _row(renderer: str, setting: str, clock: float, cores: float, noise: float) -> JsonObject:
    return {
        "renderer": renderer,
        "setting": setting,
        "seconds": clock,
        "core_seconds": cores,
        "noise": noise,
    }


def _cores_s() -> float:
    """Return the CPU time of all child processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


_DERMIS = (sys.executable, "-m", "dermis")


def _run(command: list[str]) -> str:
    """Return the output of a command.

    Raises DermisError if it fails.
    """
    ran = subprocess.run(command, capture_output=True, text=True, timeout=_LONGEST_S, check=False)
    if ran.returncode != 0:
        said = (ran.stderr.strip() or ran.stdout.strip() or "it said nothing").splitlines()[-1]
        refuse(" ".join(command[:4]), "a command that works", said, "Try it by hand")
    return ran.stdout


if __name__ == "__main__":
    run_script(main)
