"""Measure frames of moving heads.

    python benchmarks/motion.py -o result.json

Compares, in one run, frames with new light, skin and camera to frames that also have a new shape.
"""

from __future__ import annotations

import json
import statistics
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import count, cycle
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from dermis.apps.validation.benchmarks.cases import (
    BenchmarkCase,
    case_scenes,
    case_settings,
    pose_at_moment,
    with_test_rig,
)
from dermis.apps.validation.benchmarks.measure import CPU_FRAME_COUNTS, FrameCounts, sequence_ms, stage_ms
from dermis.apps.validation.pages import JsonObject
from dermis.base.atomic_write import atomic_file, check_output
from dermis.base.command_line import run_script
from dermis.base.console import print_json
from dermis.frame.renderer import Renderer
from dermis.gpu.memory import allocated_bytes
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene import Scene, Settings, Skin
from dermis.scene.heads import load_head

_ON_GPU = BenchmarkCase()  # 1920 x 1080, atlas 2048, three shadowed lights, six Gaussians
_ON_CPU = BenchmarkCase((1024, 1024), atlas=1024)
_TARGETS, _MOMENTS = 52, 60
_PEOPLE = 4
_SAMPLES = 40  # number of memory samples


def main(
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    head: str = "lee_perry_smith",
    adapter: str = "auto",
    frames: int = 0,
    interreflection: bool = True,
) -> int:
    """Measure, print, and write the figures if a file is given.

    Parameters
    ----------
    output:
        JSON file to write.
    head:
        A sample or a file.
    adapter:
        auto (the best), cpu (software), or part of an adapter's name.
    frames:
        Number of frames of the memory test; 5000 for the table of docs/performance.md.
    interreflection:
        Whether timed frames include interreflection.
    """
    if output is not None:
        check_output(output, (".json",))
    renderer, loaded = Renderer(adapter), load_head(head, subdivide=0)
    software = renderer.device.adapter.kind == "CPU"
    case, effort = (_ON_CPU, CPU_FRAME_COUNTS) if software else (_ON_GPU, FrameCounts())
    with tempfile.TemporaryDirectory() as folder:
        found: JsonObject = {"adapter": renderer.device.adapter.name, "head": head}
        settings = case_settings(case).model_copy(update={"interreflection": interreflection})
        found |= moving(renderer, case, settings, loaded, Path(folder), effort)
        found |= {"another_person_ms": people(renderer, case, loaded)}
        if frames:
            found |= {
                "memory": memory(renderer, replace(case, targets=_TARGETS), loaded, Path(folder), frames)
            }
    print_json(found)
    if output is not None:
        with atomic_file(output) as trial:
            trial.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    return 0


def moving(
    renderer: Renderer, case: BenchmarkCase, settings: Settings, head: Head, folder: Path, effort: FrameCounts
) -> JsonObject:
    """Measure frames with changing skin, lights and camera, in the rest pose and with a new shape."""
    found = JsonObject()
    scenes = {
        "still": case_scenes(case, head, folder, _MOMENTS),
        "moving": case_scenes(replace(case, targets=_TARGETS), head, folder, _MOMENTS),
    }
    endless = {name: with_new_skins(several) for name, several in scenes.items()}
    for each in endless.values():
        sequence_ms(renderer, each, max(2, effort.warmup), settings)
    times: dict[str, list[float]] = {name: [] for name in endless}
    for _ in range(3):  # alternately, so that other load slows both down
        for name, each in endless.items():
            sequence_ms(renderer, each, 2, settings)  # a new head has new tables
            times[name].append(sequence_ms(renderer, each, effort.sequence, settings) / effort.sequence)
    for name, each in endless.items():
        sequence_ms(renderer, each, 2, settings)
        found[name] = {"frame_ms": min(times[name]), "device_ms": stage_ms(renderer, each, settings, effort)}
        found[name]["python_ms"] = python_ms(renderer, each, settings, effort)
    ratio = statistics.median(a / b for a, b in zip(times["moving"], times["still"], strict=True))
    return found | {"moving_over_still": ratio}


def with_new_skins(scenes: list[Scene]) -> Iterator[Scene]:
    """Yield the scenes repeatedly, each time with a skin that has not been used before."""
    for number, scene in zip(count(), cycle(scenes), strict=False):
        skin = scene.skin.model_copy(update={"roughness": 0.2 + 0.3 * ((0.618 * number) % 1.0)})
        yield replace(scene, skin=skin)


def python_ms(renderer: Renderer, scenes: Iterator[Scene], settings: Settings, effort: FrameCounts) -> float:
    """Return the median time that Python takes for a frame while the device is idle [ms]."""
    found = []
    for _ in range(max(effort.sequence, 3)):
        scene = next(scenes)
        renderer.device.wait()
        started = time.perf_counter()
        renderer.draw(scene, settings, timed=False)
        found.append(1e3 * (time.perf_counter() - started))
    return statistics.median(found)


def people(renderer: Renderer, case: BenchmarkCase, head: Head) -> list[float]:
    """Return the time to the first frame of each of several other people, with the same topology [ms]."""
    settings, found = case_settings(case), []
    renderer.draw(Scene(head), settings)
    for number in range(_PEOPLE):
        stretched = head.positions_mm * np.array([1.0 + 0.02 * number, 0.97, 1.0], np.float32)
        scene = Scene(head, skin=Skin(), pose=Pose(positions_mm=stretched))
        renderer.device.wait()
        started = time.perf_counter()
        renderer.draw(scene, settings, timed=False)
        renderer.device.wait()
        found.append(1e3 * (time.perf_counter() - started))
    return found


def resident_mb() -> float:
    """Return the resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def memory(renderer: Renderer, case: BenchmarkCase, head: Head, folder: Path, frames: int) -> JsonObject:
    """Return the memory of process and device over the frames of a motion without repetition [MB]."""
    scene, settings = case_scenes(case, head, folder, 1)[0], case_settings(case)
    moving, taken = with_test_rig(head, case.targets), list[tuple[int, float, float]]()
    for number in range(frames):
        posed = replace(scene, head=moving, pose=pose_at_moment(moving, number))
        renderer.draw(posed, settings, timed=False)
        if number * _SAMPLES // frames >= len(taken):
            taken.append((number, resident_mb(), allocated_bytes() / 1e6))
    renderer.device.wait()
    later = [one for one in taken if one[0] >= min(200, frames // 2)]
    growth = {
        name: max(one[k] for one in later) / later[0][k] - 1.0 for k, name in ((1, "process"), (2, "device"))
    }
    return {"growth": growth, "frame_process_device_mb": taken}


if __name__ == "__main__":
    run_script(main)
