"""Light that enters on the far side of thin parts and leaves here: ears, nostrils, lips, eyelids."""

from __future__ import annotations

from typing import Any

from dermis.frame.atlas_layout import AtlasLayout, Translucency
from dermis.frame.levels import Blur, Levels
from dermis.frame.lights.records import oblique
from dermis.frame.passes import each, program
from dermis.gpu import Constants, Recorder

_TEAMS: Constants = (("SIZE", 128), ("TEAM", 16), ("ROUND", 4))
_ALONE: Constants = (("SIZE", 128), ("TEAM", 1), ("ROUND", 1))  # software adapters pay for barriers
_GATHERING = 64  # invocations of a workgroup, as in translucency_gather.wgsl


def draw(graph: Recorder, levels: Levels, blur: Blur, thin: Translucency, constants: Constants = ()) -> Any:
    """The light through thin parts: that of the blurred layers, summed over each receiver's sources.

    constants : of translucency.wgsl, in place of those that suit the device

    Source: [JensenBuhler2002; dEonLuebke2007].
    """
    device, pairs, level = graph.device, thin.pairs, blur.own[1 + thin.layer]
    halved = blur.halvings[level]
    gather = program(device, "translucency_gather.wgsl")
    record = gather.record(
        "Entering",
        layer=level - levels.first[halved],
        sources=pairs.sources[1],
        halved=halved,
        scale=1.0 / blur.scale,
    )
    entering = {
        "entering": record,
        "levels": levels.stacks[halved],
        "source_points": thin.source_points,
        "slants": thin.slants if thin.slabs else thin.evenly,
        "gathered": thin.gathered,
    }
    graph.dispatch("translucency", gather, entering, each(pairs.sources[1], _GATHERING))
    add_up(graph, thin, thin.gathered, pairs.light, constants)
    return pairs.light


def draw_slants(graph: Recorder, layout: AtlasLayout, constants: Constants) -> None:
    """How much of the light where sources lie passes deep slabs.

    constants : pipeline constants of the lights
    """
    thin = layout.translucency
    assert thin is not None
    shader = program(graph.device, "translucency_slants.wgsl", oblique(constants))
    count = thin.pairs.sources[1]
    bound = {
        **layout.lit,
        "surfaces": layout.surfaces,
        "slanted": shader.record("Slanted", sources=count),
        "source_points": thin.source_points,
        "slants": thin.slants,
    }
    graph.dispatch("translucency", shader, bound, each(count, _GATHERING))


def add_up(
    graph: Recorder,
    thin: Translucency,
    gathered: Any,
    into: Any,
    constants: Constants = (),
    stage: str = "translucency",
) -> None:
    """Sum what sources give by the pairs' weights.

    gathered : buffer of their light
    into : texture of the coarse atlas
    """
    device, pairs = graph.device, thin.pairs
    bound = {"receivers": pairs.sums, "weights": thin.weights, "gathered": gathered, "transmitted": into}
    chosen = dict((_ALONE if device.adapter.kind == "CPU" else _TEAMS) + constants)
    shader = program(device, "translucency.wgsl", tuple(chosen.items()))
    receivers = int(chosen["SIZE"]) // int(chosen["TEAM"])  # of a workgroup
    graph.dispatch(stage, shader, bound, each(pairs.receivers[1], receivers))
