"""Dials of the page: what each turns, by the differences that it makes in a frame's numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.targets.web.describe_frames import Json
from dermis.apps.export.targets.web.packing import Packer
from dermis.base.errors import refuse
from dermis.frame.inputs import FrameInputs
from dermis.gpu.capture import CapturedFrame, CapturedPass
from dermis.gpu.types import UniformRecord
from dermis.human.expressions import expression
from dermis.human.skin.painted import PaintedMaps
from dermis.mesh.pose import Pose
from dermis.scene.model import Scene

Floats = NDArray[np.float32]
_EXPRESSIONS = {"smile": "full-smile", "open mouth": "open-jaw", "frown": "full-frown"}
"""Expressions at a dial's end, by the dial's name."""
_ROUGHNESS_FACTORS = (0.5, 1.0, 1.7)
PIGMENT_FACTORS = (0.4, 1.0, 3.0)
"""Of a person's own melanin and blood."""


@dataclass(frozen=True)
class Slider:
    """Something to turn.

    values : of its nodes, increasing; `default_value` is the one that the frame was taken with
    scenes : for each node the scene, None at rest
    moves : whether only the head's motion differs
    """

    name: str
    values: tuple[float, ...]
    default_value: float
    scenes: tuple[Scene | None, ...]
    changes_pose_only: bool = False


def node_inputs(dial: Slider, prepare: Callable[[Scene], FrameInputs], base: FrameInputs) -> Iterator[FrameInputs | None]:
    """Yield what a frame reads at each node, None at rest."""
    for scene in dial.scenes:
        if scene is None:
            yield None
        elif dial.changes_pose_only:
            posed = prepare(scene)
            yield replace(base, motion=posed.motion, view=posed.view)
        else:
            yield prepare(scene)


def slider_changes(base: CapturedFrame, node: CapturedFrame, packer: Packer) -> Json:
    """Return the changes of a node in records and buffers: first word, and differences as floats.

    Whole numbers stay those of the base, as do the pairs of places that light passes between.

    DermisError : its passes are others
    """
    stages = [[one.stage for one in captured.passes] for captured in (base, node)]
    if stages[0] != stages[1]:
        refuse("dial", "the same passes at each of its nodes", "they differ", "Leave it out")
    pairs = enumerate(zip(base.records, node.records, strict=True))
    records = [(k, (_floats(one), _floats(other))) for k, ((_, one), (_, other)) in pairs]
    hosts = enumerate(zip(base.passes, node.passes, strict=True))
    written = [(k, (_written(one), _written(other))) for k, (one, other) in hosts if one.written]
    return {"records": _parts(records, packer), "written": _parts(written, packer)}


def _floats(record: UniformRecord) -> Floats:
    """Return a record as floats, 0 where it has whole numbers."""
    found = np.frombuffer(record.tobytes(), "<f4").copy()
    found[~_is_float(record.dtype)] = 0.0
    return found


def _is_float(dtype: np.dtype[Any]) -> NDArray[np.bool_]:
    """Return which words of a record are floats."""
    found = np.zeros(dtype.itemsize // 4, np.bool_)
    for kind, offset, *_ in (dtype.fields or {}).values():
        words = slice(offset // 4, (offset + kind.itemsize) // 4)
        base, count = kind.base, int(np.prod(kind.shape, dtype=int))
        found[words] = np.tile(_is_float(base), count) if base.fields else base.kind == "f"
    return found


def _written(one: CapturedPass) -> Floats:
    return np.frombuffer(one.written[1] if one.written else b"", "<f4")


def _parts(pairs: list[tuple[int, tuple[Floats, Floats]]], packer: Packer) -> list[tuple[int, int, int]]:
    found = []
    for number, (before, after) in pairs:
        if before.tobytes() == after.tobytes():
            continue
        if len(before) != len(after):
            refuse("dial", "the same numbers at each of its nodes", "their count differs", "Leave it out")
        with np.errstate(all="ignore"):
            difference = np.where(before == after, np.float32(0.0), after - before).astype("<f4")
        apart = np.flatnonzero(difference)
        if len(apart):
            part = difference[apart[0] : apart[-1] + 1]
            found.append((number, int(apart[0]), packer.add(part.view(np.uint8))))
    return found


def scene_sliders(scene: Scene) -> tuple[Slider, ...]:
    """Return a scene's dials: expressions where the head has them, pigments where skin is painted."""
    return (*_pigments(scene), _roughness(scene), *_expressions(scene))


def _roughness(scene: Scene) -> Slider:
    default_value = scene.skin.roughness
    values = tuple(default_value * factor for factor in _ROUGHNESS_FACTORS)
    scenes = [replace(scene, skin=scene.skin.model_copy(update={"roughness": value})) for value in values]
    return Slider("roughness", values, default_value, (scenes[0], None, scenes[2]))


def _expressions(scene: Scene) -> list[Slider]:
    known = set(scene.head.targets)
    ends = {dial: expression(name) for dial, name in _EXPRESSIONS.items()}
    return [
        Slider(name, (0.0, 1.0), 0.0, (None, replace(scene, pose=Pose(weights))), changes_pose_only=True)
        for name, weights in ends.items()
        if known >= set(weights)
    ]


def _pigments(scene: Scene) -> list[Slider]:
    """Return the dials of melanin and blood, which change the spread of light and the painted colour."""
    pigments, maps = scene.skin.pigments, scene.head.maps
    if pigments is None or not isinstance(maps, PaintedMaps) or scene.skin.albedo != "map":
        return []
    made = []
    for name in ("melanin", "blood"):
        default_value = getattr(maps.look, name)
        values = tuple(min(1.0, default_value * factor) for factor in PIGMENT_FACTORS)
        changed = (None if value == default_value else _pigmented(scene, maps, name, value) for value in values)
        made.append(Slider(name, values, default_value, tuple(changed)))
    return made


def _pigmented(scene: Scene, maps: PaintedMaps, name: str, value: float) -> Scene:
    assert scene.skin.pigments is not None
    pigments = scene.skin.pigments.model_copy(update={name: value})
    changed: Any = {name: value}
    painted = replace(maps, look=replace(maps.look, **changed))
    skin = scene.skin.model_copy(update={"pigments": pigments})
    return replace(scene, head=replace(scene.head, maps=painted), skin=skin)
