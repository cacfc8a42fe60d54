"""The simulation of guides of swing_guides.wgsl in NumPy with float64."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.hair.swing import SWING_CELL_MM, SWING_CELLS

Doubles = NDArray[np.float64]
SUPPORT_HEIGHT_MM, SUPPORT_Y_MM, GRAVITY, CANTILEVER = 20.0, -60.0, 9810.0, 60000.0
MAX_FREQUENCY, MIN_LEVER_MM, DAMPING_RATIO, DRAG, FRICTION = 1000.0, 5.0, 0.3, 1.0, 20.0
BEND_STIFFNESS, CLEARANCE_MM, MAX_PUSH_MM, ITERATIONS, LAST_ITERATIONS = 2000.0, 0.5, 4.0, 3, 5
MAX_SPEED, FAR_MM, LEAST_PIVOT = 4000.0, 16.0, 1e-4


class Grid(NamedTuple):
    """Colliders before and after a frame, with the collider of each cell; -1 for none."""

    before: Doubles
    now: Doubles
    normals: Doubles
    low: Doubles
    cells: NDArray[np.int64]


class Knots(NamedTuple):
    """Knots (g, k) of guides between frames."""

    position: Doubles
    velocity: Doubles
    shape: Doubles
    length: Doubles
    clearance: Doubles
    lever: Doubles


def make_grid(before: Doubles, now: Doubles, normals: Doubles, low: Doubles) -> Grid:
    at = (now - low) / SWING_CELL_MM
    middle = np.floor(at).astype(np.int64)
    best = np.full(int(np.prod(SWING_CELLS)), 1 << 62)
    for step in np.ndindex(3, 3, 3):
        cell = middle + np.array(step) - 1
        inside = ((cell >= 0) & (cell < SWING_CELLS)).all(axis=1)
        away = SWING_CELL_MM * np.linalg.norm(cell + 0.5 - at, axis=1)
        word = (np.floor(256.0 * away).astype(np.int64) << 18) | np.arange(len(now))
        np.minimum.at(best, flat(cell[inside]), word[inside])
    return Grid(before, now, normals, low, np.where(best == 1 << 62, -1, best & ((1 << 18) - 1)))


def flat(cell: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.asarray((cell[..., 2] * SWING_CELLS[1] + cell[..., 1]) * SWING_CELLS[0] + cell[..., 0])


def nearest_skin(grid: Grid, p: Doubles, shift: Doubles | float, rest: float) -> tuple[Doubles, Doubles]:
    """Return the signed distance of points (..., 3) from skin [mm], and its normal, 0 if none is near."""
    at = np.floor((p + shift - grid.low) / SWING_CELL_MM - 0.5).astype(np.int64)
    outside = ((at < 0) | (at >= np.array(SWING_CELLS) - 1)).any(axis=-1)
    at = np.where(outside[..., None], 0, at)
    normal, height = np.zeros_like(p), np.zeros(p.shape[:-1])
    for step in np.ndindex(2, 2, 2):
        index = grid.cells[flat(at + np.array(step))]
        away = p - ((1.0 - rest) * grid.now[index] + rest * grid.before[index])
        weight = np.where(outside | (index < 0), 0.0, 1.0 / ((away**2).sum(axis=-1) + 0.05))
        normal += weight[..., None] * grid.normals[index]
        height += weight * (away * grid.normals[index]).sum(axis=-1)
    size = np.linalg.norm(normal, axis=-1)
    found = size > 0.0
    size = np.where(found, size, 1.0)
    return np.where(found, np.minimum(height / size, FAR_MM), FAR_MM), normal / size[..., None]


def levers(rest_mm: Doubles) -> Doubles:
    """Return the distance of each knot (g, k) from the last place at which the head holds its guide [mm].

    rest_mm : (g, k, 4) `Guides.rest_mm`
    """
    held = np.zeros(rest_mm.shape[:2], np.int64)
    for k in range(1, rest_mm.shape[1]):
        holds = (rest_mm[:, k, 3] < SUPPORT_HEIGHT_MM) & (rest_mm[:, k, 1] > SUPPORT_Y_MM)
        held[:, k] = np.where(holds, k, held[:, k - 1])
    place = rest_mm[..., :3]
    return np.asarray(np.linalg.norm(place - np.take_along_axis(place, held[..., None], axis=1), axis=2))


def at_rest(rest_mm: Doubles, shape: Doubles, grid: Grid) -> Knots:
    edges = np.linalg.norm(np.diff(shape, axis=1, prepend=shape[:, :1]), axis=2)
    clearance = np.minimum(nearest_skin(grid, shape, 0.0, 0.0)[0], CLEARANCE_MM)
    return Knots(shape, np.zeros_like(shape), shape, edges, clearance, levers(rest_mm))


def advance(knots: Knots, shape_now: Doubles, grid: Grid, gravity: Doubles, substeps: int, h: float) -> Knots:
    """Return the knots after a frame of `substeps` steps of h seconds.

    shape_now : (g, k, 3) stiff guides at its end
    gravity : (3,) acceleration [mm/s2]
    """
    lever = np.maximum(knots.lever, MIN_LEVER_MM)
    frequency = np.minimum(np.sqrt(GRAVITY / lever + (CANTILEVER / lever**2) ** 2), MAX_FREQUENCY)[..., None]
    spring, bend = (h * frequency) ** 2, h * h * BEND_STIFFNESS
    mobility = 1.0 / (1.0 + spring)
    mobility[:, 0] = 0.0
    damping = DRAG + 2.0 * DAMPING_RATIO * frequency
    shape_velocity = (shape_now - knots.shape) / (substeps * h)
    x, v = knots.position, knots.velocity
    for n in range(1, substeps + 1):
        rest = 1.0 - n / substeps
        shape = rest * knots.shape + (1.0 - rest) * shape_now
        p = (x + h * (v + h * gravity) + spring * shape) / (1.0 + spring)
        p[:, 0] = shape[:, 0]
        bend_knots(p, shape, bend, mobility)
        pushed = np.zeros_like(p)
        for _ in range(ITERATIONS):
            distance, normal = nearest_skin(grid, p, shape_now - shape, rest)
            inside = np.clip(knots.clearance - distance, 0.0, MAX_PUSH_MM)
            inside[:, 0] = 0.0
            pushed += inside[..., None] * normal
            p = p + inside[..., None] * normal
            relax_lengths(p, knots.length, mobility[..., 0])
        outwards = pushed / np.maximum(np.linalg.norm(pushed, axis=-1, keepdims=True), 1e-9)
        moved = (p - x - pushed) / h - shape_velocity
        moved -= np.minimum((moved * outwards).sum(axis=-1, keepdims=True), 0.0) * outwards
        touches = (pushed != 0.0).any(axis=-1, keepdims=True)
        slowed = np.exp(-h * (damping + FRICTION * touches))
        speed = np.linalg.norm(moved, axis=-1, keepdims=True)
        v = shape_velocity + np.minimum(slowed, MAX_SPEED / np.maximum(speed, 1e-6)) * moved
        restore_lengths(p, knots.length)
        for _ in range(LAST_ITERATIONS):
            distance, normal = nearest_skin(grid, p, shape_now - shape, rest)
            inside = np.clip(knots.clearance - distance, 0.0, MAX_PUSH_MM)
            inside[:, 0] = 0.0
            p = p + inside[..., None] * normal
            restore_lengths(p, knots.length)
        x = p
    return knots._replace(position=x, velocity=v, shape=shape_now)


def bend_knots(p: Doubles, shape: Doubles, stiffness: float, mobility: Doubles) -> None:
    """Move knots towards the curvature of the stiff guide."""
    moved = p - shape
    error = moved[:, 2:] - 2.0 * moved[:, 1:-1] + moved[:, :-2]
    factor = stiffness / (1.0 + 6.0 * stiffness)
    p[:, :-2] -= factor * mobility[:, :-2] * error
    p[:, 2:] -= factor * mobility[:, 2:] * error
    p[:, 1:-1] += 2.0 * factor * mobility[:, 1:-1] * error


def relax_lengths(p: Doubles, length: Doubles, mobility: Doubles) -> None:
    """Move knots by the solution of the linear system of tensions; by a dense solver."""
    along = np.diff(p, axis=1)
    stretch = np.linalg.norm(along, axis=2)
    along /= np.maximum(stretch, 1e-6)[..., None]
    count = along.shape[1]
    matrix = np.zeros((len(p), count, count))
    diagonal, after = np.arange(count), np.arange(count - 1)
    matrix[:, diagonal, diagonal] = mobility[:, :-1] + mobility[:, 1:] + LEAST_PIVOT
    beside = -mobility[:, 1:-1] * (along[:, :-1] * along[:, 1:]).sum(axis=2)
    matrix[:, after, after + 1] = matrix[:, after + 1, after] = beside
    tension = np.linalg.solve(matrix, (length[:, 1:] - stretch)[..., None]) * along
    p[:, 1:] += mobility[:, 1:, None] * tension
    p[:, :-1] -= mobility[:, :-1, None] * tension


def restore_lengths(p: Doubles, length: Doubles) -> None:
    for i in range(1, p.shape[1]):
        along = p[:, i] - p[:, i - 1]
        size = np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-6)
        p[:, i] = p[:, i - 1] + length[:, i, None] / size * along
