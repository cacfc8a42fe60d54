"""Time frames of skins with few Gaussians, with and without intermediate blur levels.

python benchmarks/few_gaussians.py -o result.json
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from dermis.apps.validation.benchmarks.cases import BenchmarkCase, case_scenes, case_settings
from dermis.apps.validation.benchmarks.measure import CPU_FRAME_COUNTS, FrameCounts, stage_ms
from dermis.apps.validation.pages import JsonObject
from dermis.base.atomic_write import atomic_file, check_output
from dermis.base.command_line import run_script
from dermis.base.console import print_json
from dermis.frame.renderer import Renderer
from dermis.frame.techniques.technique import AtlasTechnique
from dermis.frame.techniques.texture_space import TextureSpace
from dermis.mesh.head import Head
from dermis.scene.heads import load_head
from dermis.scene.techniques import TECHNIQUES

_AT_ONCE = "at-once"
_GPU_CASE, _CPU_CASE = BenchmarkCase(), BenchmarkCase((512, 512), atlas=1024)
_GAUSSIAN_COUNTS = (1, 2, 3, 4, 6)


class AtOnce(TextureSpace):
    """Technique that blurs each Gaussian from the previous one, without intermediate levels."""

    add_intermediate_levels = AtlasTechnique.add_intermediate_levels


def main(
    *,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    head: str = "lee_perry_smith",
    adapter: str = "auto",
    atlas: int = 0,
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
    atlas:
        Side of the atlas [texel]; 0 for 2048 on GPUs and 1024 on software adapters.
    """
    if output is not None:
        check_output(output, (".json",))
    renderer, loaded = Renderer(adapter), load_head(head)
    software = renderer.device.adapter.kind == "CPU"
    base_case = _CPU_CASE if software else _GPU_CASE
    base_case = replace(base_case, atlas=atlas or base_case.atlas)
    frame_counts = CPU_FRAME_COUNTS if software else FrameCounts(warmup=60, sequence=1, timed=15)
    rows = [
        compare_variants(renderer, loaded, replace(base_case, gaussians=count), frame_counts)
        for count in _GAUSSIAN_COUNTS
    ]
    found = {"adapter": renderer.device.adapter.name, "atlas": base_case.atlas, "rows": rows}
    if output is not None:
        with atomic_file(output) as partial:
            partial.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print_json(found)
    return 0


def compare_variants(
    renderer: Renderer, head: Head, case: BenchmarkCase, frame_counts: FrameCounts
) -> JsonObject:
    """Return device times with and without intermediate levels [ms], and the relative RMSE of pictures."""
    row: JsonObject = {"gaussians": case.gaussians}
    pictures = []
    with tempfile.TemporaryDirectory() as folder, TECHNIQUES.temporary_entry(_AT_ONCE, AtOnce()):
        scenes = case_scenes(case, head, Path(folder), 8)
        for name, technique in (("in steps", case.technique), ("at once", _AT_ONCE)):
            settings = case_settings(replace(case, technique=technique))
            pictures.append(renderer.draw(scenes[0], settings).linear())
            blur = renderer.prepare(scenes[0], settings).blurs[0]
            drawn = stage_ms(renderer, cycle([*scenes[1:], scenes[0]]), settings, frame_counts)
            row[name] = {stage: round(drawn[stage], 4) for stage in ("diffuse", "combine", "total")}
            row[name] |= {"sigma_mm": np.sqrt(blur.variance_mm2).round(2).tolist(), "halvings": blur.halvings}
    one, other = pictures
    row["apart"] = float(np.sqrt(((one - other) ** 2).mean() / (other**2).mean()))
    return row


if __name__ == "__main__":
    run_script(main)
