"""Light from skin to skin through the air: patches lit, a few bounces, and what reaches each cell."""

from __future__ import annotations

from itertools import cycle, islice
from typing import Any

from dermis.atlas.interreflection import SAMPLES, SIDE
from dermis.frame.interreflection import Interreflection, LinkSpace
from dermis.frame.passes import EACH, each, program
from dermis.gpu import Bindings, Constants, Device, Recorder

_BOUNCES = 4  # between patches; gathering adds another
_TEAM = 16  # invocations of a patch or a cell


def draw(graph: Recorder, lit: Bindings, made: Interreflection, constants: Constants) -> None:
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
    device, sent, team = graph.device, made.leaving, _team(graph.device)
    chosen: Constants = (("TEAM", team), ("MEAN", int(made.occluded)))
    patches, cells = each(made.places[1] // SAMPLES, EACH // team), each(SIDE * SIDE, EACH // team)
    alike = {"leaving": made.leaving, "around": made.around}
    means = program(device, "interreflection_means.wgsl", chosen[:1])
    graph.dispatch("interreflection", means, {"emitted": made.emitted, **alike}, patches)
    bounce = program(device, "interreflection_bounce.wgsl", chosen)
    for after in islice(cycle(made.patches), _BOUNCES):
        bound = {**made.bounces, **alike, "sent": sent, "after": after}
        graph.dispatch("interreflection", bounce, bound, patches)
        sent = after
    gather = program(device, "interreflection_gather.wgsl", chosen)
    bound = {**made.cells, "sent": sent, "from_skin": made.from_skin}
    graph.dispatch("interreflection", gather, bound, cells)


def _team(device: Device) -> int:
    """Invocations that share links: few patches leave a GPU idle, and software waits at barriers."""
    return 1 if device.adapter.kind == "CPU" else _TEAM
