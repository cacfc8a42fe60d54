"""Shares of melanin and blood in the skin that pixels see."""

from __future__ import annotations

from typing import Any, NamedTuple

from dermis.frame.passes.outputs import planes as outputs
from dermis.frame.passes.outputs.geometry import look_of
from dermis.frame.passes.outputs.planes import Planes
from dermis.frame.projection import Triple
from dermis.gpu import Bindings, Recorder


class Pigmented(NamedTuple):
    """Where a skin's pigments are known from.

    everywhere : (2,) shares of melanin and blood of a skin that is alike everywhere; None for painted maps
    """

    everywhere: tuple[float, float] | None


def draw(
    graph: Recorder,
    planes: Planes,
    lit: Bindings,
    look: tuple[Any, Triple],
    centres: Any,
    skin: Pigmented,
) -> None:
    """Fill the planes.

    lit : resources of the shading
    look : record of the shading, and the head's centre
    centres : texture of the triangles at the pixels' centres
    """
    shader = outputs.stage_program(graph.device, planes)
    everywhere = skin.everywhere or (0.0, 0.0)
    record = shader.record("Pigments", everywhere=everywhere, painted=skin.everywhere is None)
    bound = {**lit, "look": look_of(shader, *look), "centres": centres, "pigments": record}
    outputs.draw(graph, planes, shader, bound)
