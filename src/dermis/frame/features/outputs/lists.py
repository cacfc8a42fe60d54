"""Lists of the outputs that each stage can make, for its shader."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from dermis.gpu.wgsl_source import Member
from dermis.scene.outputs import OUTPUTS, Output


def output_lists() -> Mapping[str, Callable[[], Sequence[Member]]]:
    """A list for each stage, features/outputs/STAGE.wgsl: STAGE_outputs, the outputs that it can make."""
    stages = {one.stage for one in OUTPUTS.values()}
    return {f"{stage}_outputs": partial(_made_by, stage) for stage in sorted(stages)}


def _made_by(stage: str) -> list[Member]:
    return [Member(one.name, one.shader, _words(one)) for one in OUTPUTS.values() if one.stage == stage]


def _words(output: Output) -> tuple[tuple[str, str], ...]:
    """Type of its values in the shader, and the one where nothing is seen."""
    kind = output.word if output.channels == 1 else f"vec{output.channels}f"
    nothing = output.background if kind == "f32" else int(output.background)
    return ("type", kind), ("nothing", f"{kind}({nothing})")
