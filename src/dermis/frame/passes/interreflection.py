"""Light from skin to skin through the air: patches lit, a few bounces, and what reaches each cell."""

from __future__ import annotations

from typing import Any

from dermis.atlas.interreflection import SAMPLES, SIDE
from dermis.frame.interreflection import Interreflection, LinkSpace
from dermis.frame.passes import each, program
from dermis.gpu import Constants, Recorder
from dermis.gpu.program import Resources

_BOUNCES = 4  # between patches; gathering adds another


def draw(graph: Recorder, lit: Resources, made: Interreflection, constants: Constants) -> None:
    """Find the light that skin sends to skin.

    lit : what patches are lit with
    constants : pipeline constants of the lights

    Source: [Goral1984].
    """
    shader, (space, albedo) = program(graph.device, "interreflection_places.wgsl", constants), made
    (places, count), footprint = space.places, 2.0 / (SIDE * SAMPLES**0.5)
    record = shader.record("Leaving", places=count, footprint=footprint, albedo=albedo)
    own = {"leaving": record, "places": places, "emitted": space.emitted, "from_skin": space.unlit}
    graph.dispatch("interreflection", shader, {**lit, **own}, each(count))
    graph.repeat(_carry, space)


def _carry(graph: Any, made: LinkSpace) -> None:
    """Let light bounce between the patches, and gather it."""
    device, now, other = graph.device, *made.patches
    mean: Constants = (("MEAN", 1),) if made.occluded else ()
    for bounce in range(1 + _BOUNCES):
        shader = program(device, "interreflection_bounce.wgsl", (("BOUNCES", 1), *mean) if bounce else ())
        bound = {**made.bounces, "emitted": made.emitted, "sent": other, "after": now}
        graph.dispatch("interreflection", shader, bound, each(made.places[1] // SAMPLES))
        now, other = other, now
    gather = program(device, "interreflection_gather.wgsl", mean)
    bound = {**made.cells, "sent": other, "from_skin": made.from_skin}
    graph.dispatch("interreflection", gather, bound, each(SIDE * SIDE))
