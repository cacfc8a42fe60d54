"""Passes of the translucency: places of pairs, their weights, and the light that passes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.translucency.cells import Cells
from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.features.diffusion.pyramid import Blur, Levels
from dermis.frame.features.translucency.resources import PairBuffers, Translucency
from dermis.frame.lights.records import oblique
from dermis.frame.programs import each, program
from dermis.gpu import Bindings, Buffer, ComputeProgram, Constants, Device, Record, Recorder, Texture
from dermis.optics.gaussians import MOST_GAUSSIANS
from dermis.optics.thin_parts import ROWS, ThinParts

RECEIVER_BYTES, SOURCE_BYTES = 48, 32
"""Of a place that takes light, and of one that gives it; see translucent_pair.wgsl."""

_FACETS: Constants = (("FACETS", 1),)
_TEAMS: Constants = (("SIZE", 128), ("TEAM", 16), ("ROUND", 4))
_ALONE: Constants = (("SIZE", 128), ("TEAM", 1), ("ROUND", 1))  # software adapters pay for barriers
_GATHERING = 64  # invocations of a workgroup, as in translucency_gather.wgsl
Floats = NDArray[np.float64]
GRAIN = (
    0.72  # sampled at their spacing, Gaussians of more variance than this times its square are even to 1e-6
)
_ROW, _SIZE = 1024, 64  # pairs of a row, and of a workgroup in it, as in the shader
_SMOOTH = 0.45  # of the spacing; light of this standard deviation has no detail that the sources miss


def space(device: Device, count: int, size: int = 4) -> Buffer:
    """A buffer for a number of things of some bytes; never without any."""
    return device.space(size * max(1, count))


def draw_receivers(
    graph: Recorder,
    surface: Bindings,
    cells: Cells,
    listed: tuple[Buffer, int],
    points: Buffer,
    facets: bool = False,
) -> None:
    """Write points, normals and metric of the cells that receive light.

    surface : resources of geometry.wgsl, and stretch_map of the atlas
    listed : buffer of the places on the mesh, and their number
    points : buffer to write to
    facets : whether the metric is that of the triangles, and not the stretch map's
    """
    shader = program(graph.device, "translucency/translucency_receivers.wgsl", _FACETS if facets else ())
    places, count = listed
    bound: Bindings = {"cells": _record(shader, cells, count), "receivers": places, "receiver_points": points}
    graph.dispatch("pairs", shader, {**surface, **bound}, each(count))


def draw_sources(
    graph: Recorder, surface: Bindings, cells: Cells, listed: tuple[Buffer, int], points: Buffer
) -> None:
    """Write centres, normals and areas of the cells that emit light.

    surface : resources of geometry.wgsl, and the atlas
    listed : buffer of the cells, and their number
    points : buffer to write to
    """
    shader = program(graph.device, "translucency/translucency_sources.wgsl")
    places, count = listed
    bound: Bindings = {"cells": _record(shader, cells, count), "sources": places, "source_points": points}
    graph.dispatch("pairs", shader, {**surface, **bound}, each(count))


def _record(shader: ComputeProgram, cells: Cells, count: int) -> Record:
    shape = {"size": cells.size, "side": cells.side, "stride": cells.stride}
    return shader.record("Cells", **shape, count=count)


def draw(
    graph: Recorder, levels: Levels, blur: Blur, thin: Translucency, constants: Constants = ()
) -> Texture:
    """The light through thin parts: that of the blurred layers, summed over each receiver's sources.

    constants : of translucency.wgsl, in place of those that suit the device

    Source: [JensenBuhler2002; dEonLuebke2007].
    """
    device, pairs, level = graph.device, thin.pairs, blur.own[1 + thin.layer]
    halved = blur.halvings[level]
    gather = program(device, "translucency/translucency_gather.wgsl")
    record = gather.record(
        "Entering",
        layer=level - levels.first[halved],
        sources=pairs.sources[1],
        halved=halved,
        scale=1.0 / blur.scale,
    )
    entering: Bindings = {
        "entering": record,
        "levels": levels.stacks[halved],
        "source_points": thin.source_points,
        "slants": thin.slants if thin.slabs else thin.evenly,
        "gathered": thin.gathered,
    }
    graph.dispatch("translucency", gather, entering, each(pairs.sources[1], _GATHERING))
    add_up(graph, thin, thin.gathered, pairs.light, constants)
    return pairs.light


def draw_slants(graph: Recorder, layout: LitAtlas, thin: Translucency, constants: Constants) -> None:
    """How much of the light where sources lie passes deep slabs.

    constants : pipeline constants of the lights
    """
    shader = program(graph.device, "translucency/translucency_directions.wgsl", oblique(constants))
    count = thin.pairs.sources[1]
    bound: Bindings = {
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
    gathered: Buffer,
    into: Texture,
    constants: Constants = (),
    stage: str = "translucency",
) -> None:
    """Sum what sources give by the pairs' weights.

    gathered : buffer of their light
    into : texture of the coarse atlas
    """
    device, pairs = graph.device, thin.pairs
    bound: Bindings = {
        "receivers": pairs.sums,
        "weights": thin.weights,
        "gathered": gathered,
        "transmitted": into,
    }
    chosen = dict((_ALONE if device.adapter.kind == "CPU" else _TEAMS) + constants)
    shader = program(device, "translucency/translucency.wgsl", tuple(chosen.items()))
    receivers = int(chosen["SIZE"]) // int(chosen["TEAM"])  # of a workgroup
    graph.dispatch(stage, shader, bound, each(pairs.receivers[1], receivers))


def draw_weights(graph: Recorder, thin: Translucency) -> None:
    """Weigh the pairs of the surface as it is now, and sum what it does not return because of them."""
    pairs, cells = thin.pairs, thin.pairs.cells
    draw_receivers(graph, thin.surface, cells, pairs.receivers, thin.receiver_points)
    draw_sources(graph, thin.surface, cells, pairs.sources, thin.source_points)
    bound: Bindings = {
        "pairs": pairs.pairs,
        "receiver_points": thin.receiver_points,
        "source_points": thin.source_points,
        "weights": thin.weights,
    }
    shader, groups = _shader(graph.device, thin.gaussians, thin.slabs), max(1, -(-pairs.count // _ROW))
    for weighed in (thin.losing, thin.weighing):
        graph.dispatch("pairs", shader, {**bound, **weighed}, (_ROW // _SIZE, groups, 1))
        if weighed is thin.losing:
            add_up(graph, thin, thin.evenly, pairs.lost, stage="pairs")


def source_level(spacing_mm: float, variance_mm2: Floats) -> int:
    """The blurred level that is smooth enough for the sources to tell all of it."""
    smooth = np.flatnonzero(variance_mm2 >= (_SMOOTH * spacing_mm) ** 2)
    return int(smooth[0]) if len(smooth) else len(variance_mm2) - 1


def weighing(
    device: Device,
    pairs: PairBuffers,
    variance_mm2: Floats,
    weight: Floats,
    thin: ThinParts | None = None,
    passing: Floats | None = None,
) -> Bindings:
    """The record of a profile's pass, and its table.

    variance_mm2, weight : (k,) and (k, 3) of the blurred levels
    passing : (ROWS, k, 3) of the tables of thin parts
    """
    gaussian = np.zeros((MOST_GAUSSIANS, 4), np.float32)
    gaussian[: len(weight), :3], gaussian[: len(weight), 3] = weight, variance_mm2
    record = _shader(device, len(weight), thin is not None).record(
        "Weighing",
        reach_mm=1.0 if thin is None else thin.reach_mm,
        radius_mm=pairs.cells.radius_mm,
        before_mm2=variance_mm2[source_level(pairs.cells.spacing_mm, variance_mm2)],
        cell_mm2=pairs.cells.spacing_mm**2,
        grain=GRAIN,
        gaussian=gaussian,
    )
    return {"weighing": record, "passing": device.buffer(_table(len(weight), thin, passing), "STORAGE")}


def _table(gaussians: int, thin: ThinParts | None, passing: Floats | None) -> NDArray[np.float32]:
    """(ROWS k, 4) what passes by thickness and Gaussian, and how deep each thickness is; one row for none."""
    if thin is None or passing is None:
        return np.zeros((1, 4), np.float32)
    table = np.zeros((ROWS, gaussians, 4), np.float32)
    table[..., :3], table[:, 0, 3] = passing, thin.deep
    return table.reshape(-1, 4)


def _shader(device: Device, gaussians: int, slabs: bool) -> ComputeProgram:
    return program(device, "translucency/translucency_weights.wgsl", (("COUNT", gaussians), ("SLABS", slabs)))
