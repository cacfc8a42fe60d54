"""The outputs as their stages' shaders list them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from dermis.frame.outputs import OUTPUTS, Output
from dermis.gpu.wgsl_source import Member
from dermis.human.labels.classes import class_number, label_classes


def output_lists() -> Mapping[str, Callable[[], Sequence[Member]]]:
    """A list for each stage, passes/outputs/STAGE.wgsl: STAGE_outputs, the outputs that it can make."""
    stages = {one.stage for one in OUTPUTS.values()}
    return {f"{stage}_outputs": partial(_made_by, stage) for stage in sorted(stages)}


def _made_by(stage: str) -> list[Member]:
    return [Member(one.name, one.shader, _words(one)) for one in OUTPUTS.values() if one.stage == stage]


def _words(output: Output) -> tuple[tuple[str, str], ...]:
    """Type of its values in the shader, and the one where nothing is seen."""
    kind = output.word if output.channels == 1 else f"vec{output.channels}f"
    nothing = output.background if kind == "f32" else int(output.background)
    return ("type", kind), ("nothing", f"{kind}({nothing})")


def label_numbers() -> dict[str, int]:
    """Numbers that the shaders of labels fill in."""
    names = "right_brow", "left_brow", "hair", "beard", "lashes"
    return {f"class_{name}": class_number(name) for name in names} | {"class_count": len(label_classes())}
