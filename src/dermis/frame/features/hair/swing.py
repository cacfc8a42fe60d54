"""Swing of long hair: a simulation of the guides, one step for each frame of an animation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.hair.resources import Resources
from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.features.shape.shape import PoseBytes, Shape
from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Buffer, Device, MutableBindings, Recorder
from dermis.mesh.head import Head

SWING_CELLS = 80, 80, 56
"""Number of cells of the grid of colliders, along x, y and z."""
SWING_CELL_MM = 8.0
"""Side of a cell of the grid of colliders [mm]."""
SUBSTEPS_PER_S = 240.0
"""Number of substeps of the simulation per second."""
_MAX_SUBSTEPS = 60
_COLLIDER_SPACING_MM = 4.0  # at most one collider for each cube with this side
_CLOTHING = "clothing"  # label of clothing
_COVERED_SKIN_MM = 14.0  # distance from clothing within which skin is covered
_GRAVITY_MM_PER_S2 = np.array([0.0, -9810.0, 0.0])
_KNOT_BYTES = 48  # struct Knot of swing_guides.wgsl
_COLLIDER_BYTES = _GUIDE_KNOT_BYTES = 32  # two rows of vec4f


class SwingStep(NamedTuple):
    """Step of the simulation of hair, from one frame to the next.

    frame : index of the frame, 0 for the first one, at which hair is at rest
    pose_bytes : pose of the head
    gravity_mm_per_s2 : (3,) change of gravity relative to the head since the first frame [mm/s2]
    seconds : time since the previous frame [s]
    """

    frame: int
    pose_bytes: PoseBytes
    gravity_mm_per_s2: NDArray[np.float64]
    seconds: float


class Colliders(NamedTuple):
    """Vertices of skin and clothing that keep hair outside.

    vertices : buffer of the indices of the vertices
    low_mm : (3,) corner of the grid of colliders [mm]
    """

    vertices: Buffer
    low_mm: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SwingBuffers:
    """Buffers of the simulation of hair; the steps of even and of odd frames write to different ones.

    knots : buffers of the knots of the guides after each step
    colliders : buffers of the positions and normals of colliders after each step
    cells : buffer of the grid of colliders
    guides : buffer of the resulting guides, laid out like `GuideTables.guides`
    """

    device: Device
    knots: tuple[Buffer, Buffer]
    colliders: tuple[Buffer, Buffer]
    cells: Buffer
    guides: Buffer


@dataclass(frozen=True, eq=False)
class Swing:
    """Simulation of hair up to the current frame.

    buffers : buffers of the simulation
    colliders : vertices that keep hair outside
    steps : steps to run; the last one is that of the current frame
    """

    buffers: SwingBuffers
    colliders: Colliders
    steps: tuple[SwingStep, ...]


def swing_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts at `//#fill` in the swing shaders."""
    cells = {f"swing_cells_{axis}": n for axis, n in zip("xyz", SWING_CELLS, strict=True)}
    return {**cells, "swing_cell_mm": SWING_CELL_MM}


def collider_vertices(head: Head) -> NDArray[np.uint32]:
    """Return the indices of the vertices that keep hair outside, spread evenly over skin and clothing.

    Skin below clothing is left out. Headwear is not among them, because hair is inside it.
    """
    mesh = head.mesh
    skin = np.unique(mesh.triangles[mesh.material == 0])
    is_cloth = np.array([one.label == _CLOTHING for one in mesh.materials])[mesh.material]
    if is_cloth.any():
        from scipy.spatial import cKDTree

        cloth = np.unique(mesh.triangles[is_cloth])
        away = cKDTree(mesh.positions[cloth]).query(mesh.positions[skin])[0]
        skin = np.concatenate([skin[away > _COVERED_SKIN_MM], cloth])
    cubes = np.floor(mesh.positions[skin] / _COLLIDER_SPACING_MM).astype(np.int64)
    _, first = np.unique(cubes, axis=0, return_index=True)
    return np.sort(skin[first]).astype(np.uint32)


def make_colliders(device: Device, head: Head) -> Colliders:
    """Upload the colliders of a head, and place the grid around them."""
    vertices = collider_vertices(head)
    positions = head.mesh.positions[vertices].astype(np.float64)
    middle = 0.5 * (positions.min(axis=0) + positions.max(axis=0))
    low = middle - 0.5 * SWING_CELL_MM * np.array(SWING_CELLS)
    return Colliders(device.buffer(vertices, "STORAGE"), low)


def make_swing_buffers(device: Device, guide_buffer: Buffer, collider_count: int) -> SwingBuffers:
    """Allocate the buffers of a simulation.

    guide_buffer : buffer of the guides of the hair style, `GuideTables.guides`
    """
    knot_count = guide_buffer.size // _GUIDE_KNOT_BYTES

    def pair(byte_count: int) -> tuple[Buffer, Buffer]:
        return device.storage_buffer(byte_count), device.storage_buffer(byte_count)

    return SwingBuffers(
        device,
        knots=pair(_KNOT_BYTES * knot_count),
        colliders=pair(_COLLIDER_BYTES * collider_count),
        cells=device.storage_buffer(4 * int(np.prod(SWING_CELLS))),
        guides=device.storage_buffer(guide_buffer.size),
    )


def gravity_change(rotation: NDArray[np.float64], first_rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the change of gravity relative to a head since the first frame (3,), in world space [mm/s2].

    Hair at rest balances gravity. A turned head turns the forces that do this, and leaves the difference.

    rotation, first_rotation : (3, 3) rotations of the head in this frame and in the first frame
    """
    turned = rotation @ first_rotation.T @ _GRAVITY_MM_PER_S2
    return np.asarray(_GRAVITY_MM_PER_S2 - turned)


def run_step(
    graph: Recorder, strands: Resources, geometry: tuple[Shape, HeadGeometry], swing: Swing, step: SwingStep
) -> Resources:
    """Declare the passes of a step; return the resources with the guides that the step computes.

    geometry : current shape of the head, and its vertices and triangles
    """
    groom = strands.tables.groom
    if groom is None:
        return strands
    style, buffers, now = groom.style, swing.buffers, step.frame % 2
    clear = program(graph.device, "hair/swing_clear.wgsl")
    substeps = int(np.clip(np.ceil(step.seconds * SUBSTEPS_PER_S - 1e-6), 1, _MAX_SUBSTEPS))
    move = program(graph.device, "hair/swing_guides.wgsl")
    record = move.make_record(
        "Swing",
        gravity=step.gravity_mm_per_s2,
        substeps=substeps,
        low=swing.colliders.low_mm,
        step_s=step.seconds / substeps,
        frame=step.frame,
    )
    grid: MutableBindings = {"swing": record, "cells": buffers.cells}
    graph.dispatch("strands", clear, grid, workgroup_grid(buffers.cells.size // 4))
    enter = program(graph.device, "hair/swing_colliders.wgsl")
    skin: MutableBindings = {**geometry[1].resources, **grid}
    skin |= {"collider_vertices": swing.colliders.vertices, "colliders": buffers.colliders[now]}
    graph.dispatch("strands", enter, skin, workgroup_grid(swing.colliders.vertices.size // 4))
    knots: MutableBindings = {**grid, "guide_rest": style.guide_rest, "guides": style.guides}
    knots |= {"knots_before": buffers.knots[1 - now], "knots_now": buffers.knots[now]}
    knots |= {"colliders_before": buffers.colliders[1 - now], "colliders_now": buffers.colliders[now]}
    graph.dispatch(
        "strands", move, knots | {"swung_guides": buffers.guides}, (style.guide_cuts.size // 4, 1, 1)
    )
    swung = replace(groom, style=replace(style, guides=buffers.guides))
    return replace(strands, tables=replace(strands.tables, groom=swung))
