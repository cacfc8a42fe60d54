"""Dials of the page: what each turns, by the differences that it makes in a frame's numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dermis.errors import refuse
from dermis.export.web.packing import Packer
from dermis.frame.inputs import Inputs
from dermis.gpu.tape import Take
from dermis.scene.model import Scene

Json = dict[str, Any]
Words = np.ndarray[Any, np.dtype[np.uint32]]
EXPRESSIONS = {
    "smile": {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0, "cheekSquintLeft": 0.6, "cheekSquintRight": 0.6},
    "open mouth": {"jawOpen": 0.7},
    "frown": {"browDownLeft": 1.0, "browDownRight": 1.0, "mouthFrownLeft": 0.8, "mouthFrownRight": 0.8},
}
"""Weights of morph targets at a dial's end."""
ROUGHNESS = (0.15, 0.3, 0.5)
FACTORS = (0.4, 1.0, 3.0)
"""Of a person's own melanin and blood."""


@dataclass(frozen=True)
class Dial:
    """Something to turn.

    values : of its nodes, increasing; `rest` is the one that the frame was taken with
    scenes : for each node the scene, None at rest
    moves : whether only the head's motion differs
    """

    name: str
    values: tuple[float, ...]
    rest: float
    scenes: tuple[Scene | None, ...]
    moves: bool = False


def node_inputs(dial: Dial, prepare: Callable[[Scene], Inputs], base: Inputs) -> Iterator[Inputs | None]:
    """What a frame reads at each node, None at rest."""
    for scene in dial.scenes:
        if scene is None:
            yield None
        elif dial.moves:
            posed = prepare(scene)
            yield replace(base, motion=posed.motion, view=posed.view)
        else:
            yield prepare(scene)


def changes(base: Take, node: Take, packer: Packer) -> Json:
    """What a node changes: of records and of what the host writes, first word and differences as floats.

    DermisError : it changes more than floats
    """
    pairs = zip(base.records, node.records, strict=True)
    records = [(k, one[1].tobytes(), other[1].tobytes()) for k, (one, other) in enumerate(pairs)]
    hosts = zip(base.passes, node.passes, strict=True)
    written = [
        (k, one.written[1], other.written[1])
        for k, (one, other) in enumerate(hosts)
        if one.written and other.written
    ]
    return {"records": _parts(records, packer), "written": _parts(written, packer)}


def _parts(pairs: list[tuple[int, bytes, bytes]], packer: Packer) -> list[tuple[int, int, int]]:
    found = []
    for number, one, other in pairs:
        if one == other:
            continue
        if len(one) != len(other):
            refuse("dial", "the same numbers at each of its nodes", "their count differs", "Leave it out")
        before, after = np.frombuffer(one, "<f4"), np.frombuffer(other, "<f4")
        apart = np.flatnonzero(before.view(np.uint32) != after.view(np.uint32))
        part = slice(int(apart[0]), int(apart[-1]) + 1)
        difference = np.where(before[part] == after[part], 0.0, after[part] - before[part]).astype("<f4")
        found.append((number, part.start, packer.add(difference.view(np.uint8))))
    return found
