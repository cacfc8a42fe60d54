"""Colour and relief of a painted face as it moves: folds deepen, blood comes and goes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.frame.passes import map_mips, program
from dermis.gpu import Device, Graph, Recorder
from dermis.human.skin.movements import FOLDING

_FOLDING = FOLDING + 1  # numbers of the shader's record, the last of which is the flush


@dataclass(frozen=True, eq=False)
class Face:
    """What expressions change, by the names in the shaders.

    bound : of expression.wgsl
    heights : buffer that relief is taken from
    colour, relief : textures with all their mips
    """

    bound: dict[str, Any]
    heights: Any
    colour: map_mips.Mipped
    relief: map_mips.Mipped


def make_face(
    device: Device, resting: Any, at_rest: Any, moved: Any, into: tuple[map_mips.Mipped, map_mips.Mipped]
) -> Face:
    """Space for a face that moves.

    resting, at_rest, moved : colour and heights at rest, and what full movements do to them
    into : textures of colour and relief
    """
    colour, relief = into
    heights = device.space(at_rest.size)
    bound = {"resting": resting, "at_rest": at_rest, "moved": moved, "heights": heights}
    return Face(bound | {"colour": colour.levels[0]}, heights, colour, relief)


def draw(graph: Graph, face: Face, made: NDArray[np.float32]) -> None:
    """Change colour and relief.

    made : (9,) how far each movement is made, see `movements`
    """
    shader, side = program(graph.device, "painting/expression.wgsl"), face.colour.size[0]
    folding = made[:_FOLDING].reshape(2, 4)
    record = shader.record("Expression", folding=folding, pressed=made[_FOLDING], side=side)
    graph.compute("maps", shader, face.bound | {"expression": record}, (side, side))
    graph.repeat(_maps, face)


def _maps(graph: Recorder, face: Face) -> None:
    """Mips of the colour, and the relief from the heights."""
    map_mips.halve(graph, face.colour)
    map_mips.relieve(graph, face.relief, face.heights)
