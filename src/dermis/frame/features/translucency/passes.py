"""Passes of translucency, the light that enters the head in one cell of the surface and leaves in another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.translucency.cells import Cells
from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.features.diffusion.pyramid import Blur, PyramidLevels
from dermis.frame.features.translucency.resources import PairBuffers, Translucency
from dermis.frame.lights.records import with_oblique_incidence_constant
from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Bindings, Buffer, ComputeProgram, Constants, Device, Recorder, Texture
from dermis.optics.gaussians import MAX_GAUSSIANS
from dermis.optics.thin_parts import THICKNESS_ROWS, ThinParts

RECEIVER_BYTES, SOURCE_BYTES = 48, 32
"""Sizes of the structs Receiver and Source of translucent_pair.wgsl [bytes]."""

_GPU_WORKGROUP_CONSTANTS: Constants = (("SIZE", 128), ("TEAM", 16), ("ROUND", 4))
# On software adapters barriers are slow, so that each invocation works alone.
_SOFTWARE_WORKGROUP_CONSTANTS: Constants = (("SIZE", 128), ("TEAM", 1), ("ROUND", 1))
_SOURCES_PER_WORKGROUP = 64  # invocations of a workgroup, as in translucency_gather.wgsl
Floats = NDArray[np.float64]
# Least ratio of a Gaussian's variance to the squared sample spacing, for a sum that is constant to 1e-6.
_MIN_VARIANCE_RATIO = 0.72
# Pairs per row of workgroups, and per workgroup, in translucency_weights.wgsl.
_PAIRS_PER_ROW, _PAIRS_PER_GROUP = 1024, 64
_MIN_SOURCE_SMOOTHNESS = (
    0.45  # least ratio of the deviation of the light that sources sample to their spacing
)


def make_element_buffer(device: Device, element_count: int, element_bytes: int = 4) -> Buffer:
    """Allocate a buffer for elements of `element_bytes` bytes each; the buffer has room for at least one."""
    return device.storage_buffer(element_bytes * max(1, element_count))


def draw_cell_points(
    graph: Recorder,
    cell_role: str,
    surface_bindings: Bindings,
    cells: Cells,
    cell_table: tuple[Buffer, int],
    point_buffer: Buffer,
    metric_from_triangles: bool = False,
) -> None:
    """Declare the pass that writes the current positions and normals of cells where light enters or leaves.

    For cells where light enters (sources), the pass also writes the area. For cells where light leaves
    (receivers), it writes the metric, which converts offsets in the atlas to lengths.

    cell_role : "receiver" or "source"
    surface_bindings : resources of geometry.wgsl and of the atlas
    cell_table : buffer of cells, and its number of rows
    point_buffer : buffer to write to
    metric_from_triangles : whether to take the metric of receivers from the triangles instead of the stretch
        map
    """
    name, (buffer, count) = f"translucency/translucency_{cell_role}s.wgsl", cell_table
    shader = program(graph.device, name, (("FACETS", 1),) if metric_from_triangles else ())
    record = shader.make_record("Cells", size=cells.size, side=cells.side, stride=cells.stride, count=count)
    own: Bindings = {"cells": record, f"{cell_role}s": buffer, f"{cell_role}_points": point_buffer}
    graph.dispatch("pairs", shader, {**surface_bindings, **own}, workgroup_grid(count))


def draw(
    graph: Recorder, levels: PyramidLevels, blur: Blur, translucency: Translucency, constants: Constants = ()
) -> Texture:
    """Declare the passes that sum, in each receiver cell, the light from all source cells; return the sums.

    levels : blurred light over the atlas; the light that enters each source is read from one of the levels
    blur : Gaussian blurs of the levels
    constants : pipeline constants that replace the defaults of translucency.wgsl

    Source: [JensenBuhler2002; dEonLuebke2007].
    """
    device, pairs, level = (
        graph.device,
        translucency.pairs,
        blur.profile_levels[1 + translucency.source_level],
    )
    halvings = blur.halvings[level]
    gather = program(device, "translucency/translucency_gather.wgsl")
    record = gather.make_record(
        "Entering",
        layer=level - levels.first[halvings],
        sources=pairs.sources[1],
        halvings=halvings,
        scale=1.0 / blur.scale,
    )
    bindings: Bindings = {
        "entering": record,
        "levels": levels.stacks[halvings],
        "source_points": translucency.source_points,
        "direction_factors": translucency.direction_factors
        if translucency.uses_tables
        else translucency.unit_light,
        "source_light": translucency.source_light,
    }
    graph.dispatch("translucency", gather, bindings, workgroup_grid(pairs.sources[1], _SOURCES_PER_WORKGROUP))
    sum_pair_light(graph, translucency, translucency.source_light, pairs.transmitted, constants)
    return pairs.transmitted


def draw_direction_factors(
    graph: Recorder, layout: LitAtlas, translucency: Translucency, constants: Constants
) -> None:
    """Declare the pass that computes how the directions of incident light change the transmission.

    The result is one factor for each source cell. The factor applies in full only where the tissue is so
    thick that light scatters many times.

    constants : pipeline constants of the lights
    """
    shader = program(
        graph.device, "translucency/translucency_directions.wgsl", with_oblique_incidence_constant(constants)
    )
    count = translucency.pairs.sources[1]
    bindings: Bindings = {
        **layout.bindings,
        "surfaces": layout.surfaces,
        "source_count": shader.make_record("SourceCount", sources=count),
        "source_points": translucency.source_points,
        "direction_factors": translucency.direction_factors,
    }
    graph.dispatch("translucency", shader, bindings, workgroup_grid(count, _SOURCES_PER_WORKGROUP))


def sum_pair_light(
    graph: Recorder,
    translucency: Translucency,
    source_light: Buffer,
    light_sums: Texture,
    constants: Constants = (),
    stage_name: str = "translucency",
) -> None:
    """Declare the pass that sums, in each receiver cell, the light of its sources times the pair weights.

    source_light : buffer of the light of each source
    light_sums : texture for the sums, with one texel per cell of the atlas
    constants : pipeline constants that replace the defaults of translucency.wgsl
    stage_name : name of the stage in timings
    """
    device, pairs = graph.device, translucency.pairs
    bindings: Bindings = {
        "receivers": pairs.receiver_ranges,
        "weights": translucency.weights,
        "source_light": source_light,
        "transmitted": light_sums,
    }
    team = dict(
        (_SOFTWARE_WORKGROUP_CONSTANTS if device.adapter.kind == "CPU" else _GPU_WORKGROUP_CONSTANTS)
        + constants
    )
    shader = program(device, "translucency/translucency.wgsl", tuple(team.items()))
    receivers_per_group = int(team["SIZE"]) // int(team["TEAM"])
    graph.dispatch(stage_name, shader, bindings, workgroup_grid(pairs.receivers[1], receivers_per_group))


def draw_weights(graph: Recorder, translucency: Translucency) -> None:
    """Declare the passes that compute, for the current shape, the weights of all pairs of cells.

    A weight is the fraction of the light of the source cell that leaves in the receiver cell. For each
    receiver cell, the passes also compute a fraction of the diffused light that must be subtracted. Light is
    diffused as if all tissue were thick, but thin tissue returns less of it.
    """
    pairs, cells = translucency.pairs, translucency.pairs.cells
    draw_cell_points(
        graph, "receiver", translucency.surface, cells, pairs.receivers, translucency.receiver_points
    )
    draw_cell_points(graph, "source", translucency.surface, cells, pairs.sources, translucency.source_points)
    bindings: Bindings = {
        "pairs": pairs.pairs,
        "receiver_points": translucency.receiver_points,
        "source_points": translucency.source_points,
        "weights": translucency.weights,
    }
    shader = _weights_program(graph.device, translucency.gaussian_count, translucency.uses_tables)
    groups = _PAIRS_PER_ROW // _PAIRS_PER_GROUP, max(1, -(-pairs.count // _PAIRS_PER_ROW)), 1
    graph.dispatch("pairs", shader, {**bindings, **translucency.loss_bindings}, groups)
    sum_pair_light(graph, translucency, translucency.unit_light, pairs.lost, stage_name="pairs")
    graph.dispatch("pairs", shader, {**bindings, **translucency.weight_bindings}, groups)


def choose_source_level(source_spacing_mm: float, variance_mm2: Floats) -> int:
    """Return the index of the Gaussian whose blurred light is used as the light that enters the source cells.

    It is the narrowest Gaussian that blurs light enough for one value per source cell. If all are too narrow,
    it is the widest.

    source_spacing_mm : distance between neighbouring source cells [mm]
    variance_mm2 : (k,) increasing variances of the Gaussians that blur light [mm^2]
    """
    smooth = np.flatnonzero(variance_mm2 >= (_MIN_SOURCE_SMOOTHNESS * source_spacing_mm) ** 2)
    return int(smooth[0]) if len(smooth) else len(variance_mm2) - 1


def pair_weight_bindings(
    device: Device,
    pair_buffers: PairBuffers,
    variance_mm2: Floats,
    weight: Floats,
    thickness_tables: ThinParts | None = None,
    transmittance: Floats | None = None,
) -> Bindings:
    """Return the uniform record and the transmittance table of a profile for translucency_weights.wgsl.

    variance_mm2 : (k,) variances of the Gaussians that blur light [mm^2]
    weight : (k, 3) weights of these Gaussians for red, green and blue [-]
    thickness_tables : transmittance of thin tissue, and how much less it reflects than thick tissue, as
        functions of its thickness; None to compute the weights of the pairs of cells from the Gaussians
    transmittance : (THICKNESS_ROWS, k, 3) table to use: `thickness_tables.transmitted` or
        `thickness_tables.lost`; ignored without `thickness_tables`
    """
    gaussian = np.zeros((MAX_GAUSSIANS, 4), np.float32)
    gaussian[: len(weight), :3], gaussian[: len(weight), 3] = weight, variance_mm2
    record = _weights_program(device, len(weight), thickness_tables is not None).make_record(
        "PairProfile",
        reach_mm=1.0 if thickness_tables is None else thickness_tables.max_thickness_mm,
        radius_mm=pair_buffers.cells.radius_mm,
        source_mm2=variance_mm2[choose_source_level(pair_buffers.cells.cell_mm, variance_mm2)],
        cell_mm2=pair_buffers.cells.cell_mm**2,
        min_variance_ratio=_MIN_VARIANCE_RATIO,
        gaussian=gaussian,
    )
    table = _transmittance_table(len(weight), thickness_tables, transmittance)
    return {"pair_profile": record, "transmittance": device.buffer(table, "STORAGE")}


def _transmittance_table(
    gaussian_count: int, thickness_tables: ThinParts | None, transmittance: Floats | None
) -> NDArray[np.float32]:
    """Return (THICKNESS_ROWS k, 4) rows: RGB transmittance for each thickness and each of k Gaussians.

    The fourth channel holds `ThinParts.directionality` in the first row of each thickness, else 0. Without
    `thickness_tables`, the result is one row of zeros.

    transmittance : (THICKNESS_ROWS, k, 3) transmittance, one of the arrays of `thickness_tables`
    """
    if thickness_tables is None or transmittance is None:
        return np.zeros((1, 4), np.float32)
    table = np.zeros((THICKNESS_ROWS, gaussian_count, 4), np.float32)
    table[..., :3], table[:, 0, 3] = transmittance, thickness_tables.directionality
    return table.reshape(-1, 4)


def _weights_program(device: Device, gaussian_count: int, uses_tables: bool) -> ComputeProgram:
    constants = ("COUNT", gaussian_count), ("TABLES", uses_tables)
    return program(device, "translucency/translucency_weights.wgsl", constants)
