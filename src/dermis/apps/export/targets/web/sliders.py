"""Sliders of the web page, stored as changes of the uniform and buffer data of a captured frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.targets.web.frame_json import Json
from dermis.apps.export.targets.web.packing import ByteRunCollector
from dermis.base.errors import refuse
from dermis.frame.inputs import FrameInputs
from dermis.gpu.capture import CapturedFrame, CapturedPass
from dermis.gpu.types import UniformRecord
from dermis.human.expressions import expression
from dermis.human.skin.painted import PaintedMaps
from dermis.mesh.pose import Pose
from dermis.scene.model import Scene

Floats = NDArray[np.float32]
_SLIDER_EXPRESSIONS = {"smile": "full-smile", "open mouth": "open-jaw", "frown": "full-frown"}
"""Expression at the upper end of a slider, by the slider's name."""
_ROUGHNESS_FACTORS = (0.5, 1.0, 1.7)
PIGMENT_FACTORS = (0.4, 1.0, 3.0)
"""Captured values of the melanin and blood sliders, as factors of the person's own melanin or blood."""


@dataclass(frozen=True)
class Slider:
    """Slider of the web page, which interpolates between the frames captured at a few values.

    values : increasing values for which frames are captured; one of them is `default_value`
    default_value : value with which the page starts
    scenes : scene at each of these values; None at the default value
    changes_pose_only : whether all `scenes` differ from the default scene only in the head's pose
    """

    name: str
    values: tuple[float, ...]
    default_value: float
    scenes: tuple[Scene | None, ...]
    changes_pose_only: bool = False


def slider_frame_inputs(
    slider: Slider, prepare_frame_inputs: Callable[[Scene], FrameInputs], default_frame_inputs: FrameInputs
) -> Iterator[FrameInputs | None]:
    """Yield the frame inputs at each captured value of a slider; None at the default value.

    prepare_frame_inputs : function that returns the frame inputs of a scene
    default_frame_inputs : frame inputs of the default scene
    """
    for scene in slider.scenes:
        if scene is None:
            yield None
        elif slider.changes_pose_only:
            posed = prepare_frame_inputs(scene)
            yield replace(default_frame_inputs, pose_bytes=posed.pose_bytes, view=posed.view)
        else:
            yield prepare_frame_inputs(scene)


def slider_frame_changes(
    default_frame: CapturedFrame, moved_frame: CapturedFrame, byte_runs: ByteRunCollector
) -> Json:
    """Return as JSON how the frame at one value of a slider differs from the frame at the default value.

    The comparison covers the floats in uniform records (structs that shaders read as uniforms), and the data
    that passes write from the host to buffers. Each change is stored as three indices: the index of the
    record or pass, the index of its first 4-byte word that differs, and the index of the byte run with the
    differences.

    default_frame, moved_frame : captured frames at the default value and at the other value

    Raises DermisError if the two frames have different passes.
    """
    stages = [[one.stage for one in captured.passes] for captured in (default_frame, moved_frame)]
    if stages[0] != stages[1]:
        refuse("slider", "the same passes at each of its nodes", "they differ", "Remove the slider")
    pairs = enumerate(zip(default_frame.records, moved_frame.records, strict=True))
    records = [(k, (_record_floats(one), _record_floats(other))) for k, ((_, one), (_, other)) in pairs]
    passes = enumerate(zip(default_frame.passes, moved_frame.passes, strict=True))
    written = [
        (k, (_written_floats(one), _written_floats(other))) for k, (one, other) in passes if one.written
    ]
    return {
        "records": _word_differences(records, byte_runs),
        "written": _word_differences(written, byte_runs),
    }


def _record_floats(uniform_record: UniformRecord) -> Floats:
    """Return the 4-byte words of a uniform record as floats, with 0 in place of integers."""
    floats = np.frombuffer(uniform_record.tobytes(), "<f4").copy()
    floats[~_float_word_mask(uniform_record.dtype)] = 0.0
    return floats


def _float_word_mask(dtype: np.dtype[Any]) -> NDArray[np.bool_]:
    """Return a mask of the 4-byte words of a uniform record: true for words that are floats."""
    is_float = np.zeros(dtype.itemsize // 4, np.bool_)
    for member, offset, *_ in (dtype.fields or {}).values():
        words = slice(offset // 4, (offset + member.itemsize) // 4)
        base, count = member.base, int(np.prod(member.shape, dtype=int))
        is_float[words] = np.tile(_float_word_mask(base), count) if base.fields else base.kind == "f"
    return is_float


def _written_floats(captured_pass: CapturedPass) -> Floats:
    return np.frombuffer(captured_pass.written[1] if captured_pass.written else b"", "<f4")


def _word_differences(
    indexed_value_pairs: list[tuple[int, tuple[Floats, Floats]]], byte_runs: ByteRunCollector
) -> list[tuple[int, int, int]]:
    changes = []
    for index, (before, after) in indexed_value_pairs:
        if before.tobytes() == after.tobytes():
            continue
        if len(before) != len(after):
            actual = "their count differs"
            refuse("slider", "the same numbers at each of its nodes", actual, "Remove the slider")
        with np.errstate(all="ignore"):
            difference = np.where(before == after, np.float32(0.0), after - before).astype("<f4")
        changed = np.flatnonzero(difference)
        if len(changed):
            part = difference[changed[0] : changed[-1] + 1]
            changes.append((index, int(changed[0]), byte_runs.add(part.view(np.uint8))))
    return changes


def scene_sliders(scene: Scene) -> tuple[Slider, ...]:
    """Return the sliders of a scene: pigments of painted skin, roughness, and expressions."""
    return (*_pigment_sliders(scene), _roughness_slider(scene), *_expression_sliders(scene))


def _roughness_slider(scene: Scene) -> Slider:
    default = scene.skin.roughness
    values = tuple(default * factor for factor in _ROUGHNESS_FACTORS)
    scenes = [replace(scene, skin=scene.skin.model_copy(update={"roughness": value})) for value in values]
    return Slider("roughness", values, default, (scenes[0], None, scenes[2]))


def _expression_sliders(scene: Scene) -> list[Slider]:
    targets = set(scene.head.targets)
    weights = {slider: expression(name) for slider, name in _SLIDER_EXPRESSIONS.items()}
    return [
        Slider(name, (0.0, 1.0), 0.0, (None, replace(scene, pose=Pose(end))), changes_pose_only=True)
        for name, end in weights.items()
        if targets >= set(end)
    ]


def _pigment_sliders(scene: Scene) -> list[Slider]:
    """Return sliders of melanin and blood, which change the diffusion profile and the painted colour map."""
    pigments, maps = scene.skin.pigments, scene.head.maps
    if pigments is None or not isinstance(maps, PaintedMaps) or scene.skin.albedo != "map":
        return []
    sliders = []
    for name in ("melanin", "blood"):
        default = getattr(maps.look, name)
        values = tuple(min(1.0, default * factor) for factor in PIGMENT_FACTORS)
        scenes = (None if value == default else _with_pigment(scene, maps, name, value) for value in values)
        sliders.append(Slider(name, values, default, tuple(scenes)))
    return sliders


def _with_pigment(scene: Scene, painted_maps: PaintedMaps, pigment_name: str, pigment_value: float) -> Scene:
    assert scene.skin.pigments is not None
    pigments = scene.skin.pigments.model_copy(update={pigment_name: pigment_value})
    changed: Any = {pigment_name: pigment_value}
    painted = replace(painted_maps, look=replace(painted_maps.look, **changed))
    skin = scene.skin.model_copy(update={"pigments": pigments})
    return replace(scene, head=replace(scene.head, maps=painted), skin=skin)
