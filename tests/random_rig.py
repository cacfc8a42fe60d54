"""A smooth random rig like a head: a ball of points, bumps as targets, four bones."""

from __future__ import annotations

import numpy as np

from dermis.mesh.rig import MorphTargets, Rig, Skeleton
from dermis.mesh.rotations import quaternion_matrix

SIZE_MM = np.array([75.0, 110.0, 95.0])
HEIGHTS_MM = np.array([-200.0, -120.0, -70.0, -40.0])
"""Of four bones, each below the one before but the last two, which both lie below the second."""


def ball(count: int = 3000) -> np.ndarray:
    k = np.arange(count) + 0.5
    z, around = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(around), z, r * np.sin(around)])


def random_rig(seed: int = 0, targets: int = 8, unit_mm: float = 1000.0) -> Rig:
    """Return a rig whose file is in units of `unit_mm` and whose bones have arbitrary frames."""
    rng = np.random.default_rng(seed)
    points = (ball() * SIZE_MM).astype(np.float32)
    moved, deltas = [], []
    for _ in range(targets):
        centre = rng.normal(size=3)
        centre *= SIZE_MM / np.linalg.norm(centre)
        bump = np.exp(-(((points - centre) / 30) ** 2).sum(axis=1))
        near = np.flatnonzero(bump > 1e-3)
        moved.append(near.astype(np.int32))
        deltas.append((bump[near, None] * rng.normal(scale=8, size=3)).astype(np.float32))
    first = np.cumsum([0, *map(len, moved)]).astype(np.int32)
    names = tuple(f"target{k}" for k in range(targets))
    morph = MorphTargets(names, first, np.concatenate(moved), np.concatenate(deltas))
    return Rig(points, morph, _skeleton(points, rng, unit_mm))


def _skeleton(points: np.ndarray, rng: np.random.Generator, unit_mm: float) -> Skeleton:
    parent = np.array([-1, 0, 1, 1], np.int32)
    world = quaternion_matrix(rng.normal(size=(4, 4)))
    world[:, 1, 3] = HEIGHTS_MM / unit_mm
    world[3, 2, 3] = 20 / unit_mm
    local = world.copy()
    for bone in range(1, 4):
        local[bone] = np.linalg.inv(world[parent[bone]]) @ world[bone]
    rise = np.clip((points[:, 1] + 110) / 60, 0, 1)
    jaw = rise * np.exp(-(((points - [0, -60, 80]) / 35) ** 2).sum(axis=1))
    weight = np.column_stack([0.5 * (1 - rise), 0.5 * (1 - rise), rise - jaw, jaw]).astype(np.float32)
    bone = np.tile(np.arange(4, dtype=np.int32), (len(points), 1))
    to_head = np.diag([unit_mm, unit_mm, unit_mm, 1.0])
    names = ("root", "neck", "head", "jaw")
    return Skeleton(names, parent, local, np.linalg.inv(world), to_head, bone, weight)
