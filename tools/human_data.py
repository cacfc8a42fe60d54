"""Make src/dermis/human/data/human.npz: MakeHuman's parametric human as a bust with its own uv layout.

FOLDER contains the published human.npz (CC0).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from human_layout import human_layout
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, vstack

from dermis.base.command_line import run_script
from dermis.human.makehuman import DELTA_UNIT_MM
from dermis.mesh.rig import BONES_PER_POINT

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]
Arrays = dict[str, NDArray[Any]]

OUT = Path(__file__).parent.parent / "src" / "dermis" / "human" / "data" / "human.npz"
MM = 100.0  # length of a unit of the published positions
MEAN_PERSON = {
    f"macrodetails/{people}-{sex}-young": 1 / 6
    for people in ("african", "asian", "caucasian")
    for sex in ("female", "male")
}
"""Target weights of the mean person, on whom edges, seams and densities are defined."""
BONES = {  # by bone of the bust: beginnings of the names of the published bones that it replaces
    "spine": ("spine", "breast"),
    "clavicle.L": ("clavicle.L", "shoulder01.L", "upperarm01.L", "upperarm02.L", "lowerarm01.L"),
    "clavicle.R": ("clavicle.R", "shoulder01.R", "upperarm01.R", "upperarm02.R", "lowerarm01.R"),
    "neck01": ("neck01",),
    "neck02": ("neck02",),
    "neck03": ("neck03",),
    "head": (),  # all other bones
    "jaw": ("jaw", "tongue", "special04", "oris05", "oris07"),
    "eye.L": ("eye.L",),
    "eye.R": ("eye.R",),
}
CHEST_CUT_MM, CORNER_MM = 385.0, 25.0  # height of the first bust's cut, approximate radius of its corners
ARM_CUT_MM, ARM_CUT_RISE, CHEST_HALF_WIDTH_MM = 445.0, 0.35, 138.0
"""Height of the cut above the armpits, and by how much it rises outwards through the upper arms."""
CAP_RINGS = 4  # number of rings of quads from the edge of the cap to its centre


def main(folder: Path) -> None:
    """Build the bust and write the file."""
    with np.load(folder / "human.npz") as found:
        data = {name: found[name] for name in found}
    mean = MM * data["positions_dm"].astype(np.float64) + displaced_by(data, MEAN_PERSON)
    data = without_groups(data, "eyelashes")
    quads, kept, mix = clip_to_bust(data, mean)
    shape = capped(quads, data["quad_group"][kept].astype(np.int64), mix)
    published, uv = data["quads_uv"][kept].astype(np.int64), data["uv"].astype(np.float64)
    own, corner = human_layout(shape.points_mm(mean), shape.quads, published, uv, shape.group)
    made = bust(data, shape) | {"uv": own.astype(np.float32), "quads_uv": corner.astype(np.uint16)}
    made |= {"uv1": data["uv"], "quads_uv1": data["quads_uv"][kept]}
    OUT.parent.mkdir(exist_ok=True)
    np.savez_compressed(OUT, **cast(Any, made))
    sys.stdout.write(f"{OUT}  {OUT.stat().st_size / 1e6:.2f} MB, {len(made['quads'])} quads\n")


class Shape(NamedTuple):
    """Mesh whose points are linear combinations of the published points.

    quads, group : (q, 4) point indices and (q,) group indices of the quads; the caps are the last group
    mix : (n, p) sparse weights of the published points
    """

    quads: Index
    group: Index
    mix: Any

    def points_mm(self, published: Doubles) -> Doubles:
        """Return the (n, 3) positions of the points for given published positions [mm]."""
        return np.asarray(self.mix @ published)


def displacements(data: Arrays, index: int) -> tuple[Index, Doubles]:
    """Return the points that a target moves and their displacements [mm]."""
    part = slice(*data["target_offset"][index : index + 2])
    return data["target_vertex"][part].astype(np.int64), DELTA_UNIT_MM * data["target_delta_um10"][part]


def displaced_by(data: Arrays, weights: dict[str, float]) -> Doubles:
    """Return the (p, 3) displacements of the base mesh by weighted targets [mm]."""
    names, added = list(map(str, data["target_names"])), np.zeros(data["positions_dm"].shape)
    for name, weight in weights.items():
        point, delta = displacements(data, names.index(name))
        added[point] += weight * delta
    return added


def edge_distance_mm(points_mm: Doubles) -> Doubles:
    """Return the (n,) approximate distances of positions (n, 3) from the edge, negative in the bust [mm].

    The bust is the first bust with shoulders and the upper arms down to a cut above the armpits.
    """
    outside_chest = np.maximum(np.abs(points_mm[:, 0]) - CHEST_HALF_WIDTH_MM, 0.0)
    arm_cut = ARM_CUT_MM + ARM_CUT_RISE * outside_chest
    return np.minimum(first_edge_distance_mm(points_mm), arm_cut - points_mm[:, 1])


def first_edge_distance_mm(points_mm: Doubles) -> Doubles:
    """Return the distances (n,) from the edge of the first bust, negative inside [mm].

    The first bust has a level cut above the breasts, which rises outwards through the shoulders.
    """
    x, y = np.abs(points_mm[:, 0]), points_mm[:, 1]
    below, beside = CHEST_CUT_MM - y, 0.93 * (x - 118.0) - 0.37 * (y - CHEST_CUT_MM)
    return np.asarray(CORNER_MM * np.logaddexp(below / CORNER_MM, beside / CORNER_MM))


def without_groups(data: Arrays, kind: str) -> Arrays:
    """Return the data without the groups of one kind."""
    names = list(map(str, data["group_names"]))
    stays = [index for index, name in enumerate(names) if kind not in name]
    kept = np.isin(data["quad_group"], stays)
    group = np.searchsorted(stays, data["quad_group"][kept])
    named = {"group_names": np.array([names[index] for index in stays]), "quad_group": group}
    return data | named | {name: data[name][kept] for name in ("quads", "quads_uv")}


def clip_to_bust(data: Arrays, points_mm: Doubles) -> tuple[Index, Index, Any]:
    """Return the quads of the bust, their indices in the data, and the mixing weights of the points.

    Points outside the edge are moved to it along the shortest path into the bust. Quads and points of the
    first bust come first, so that indices in tables and files of earlier versions stay valid.
    """
    quads, group = data["quads"].astype(np.int64), data["quad_group"].astype(np.int64)
    inside = edge_distance_mm(points_mm) <= 0
    first = (first_edge_distance_mm(points_mm) <= 0)[quads].any(axis=1) | (group > 0)
    kept = np.concatenate([np.flatnonzero(first), np.flatnonzero(~first & inside[quads].any(axis=1))])
    quads = quads[kept]
    into, share, least = np.arange(len(points_mm)), np.zeros(len(points_mm)), np.full(len(points_mm), np.inf)
    for steps in (1, 2, 3):  # along sides, or across quads for corners without a side into the bust
        pairs = np.stack([quads, np.roll(quads, -steps, axis=1)], axis=-1).reshape(-1, 2)
        for outer, inner in pairs[inside[pairs[:, 1]] & ~inside[pairs[:, 0]]].tolist():
            part = crossing(points_mm[outer], points_mm[inner])
            way = part * np.linalg.norm(points_mm[outer] - points_mm[inner]) + (1e6 if steps == 2 else 0.0)
            if way < least[outer]:
                into[outer], share[outer], least[outer] = inner, part, way
    used = np.unique(quads[: first.sum()])
    used = np.concatenate([used, np.setdiff1d(quads, used)])
    rows = np.arange(len(used))
    values = np.concatenate([1 - share[used], share[used]])
    columns = np.concatenate([used, into[used]])
    mix = coo_array((values, (np.tile(rows, 2), columns)), shape=(len(used), len(points_mm))).tocsr()
    number = np.full(len(points_mm), -1, np.int64)
    number[used] = rows
    return number[quads], kept, mix


def crossing(outer: Doubles, inner: Doubles) -> float:
    """Return the fraction of a line between two positions at which it crosses the edge of the bust."""
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        inside = edge_distance_mm((outer + middle * (inner - outer))[None])[0] <= 0
        low, high = (low, middle) if inside else (middle, high)
    return high


def capped(quads: Index, group: Index, mix: Any) -> Shape:
    """Return the bust with its opening closed by a cap: rings of quads around a centre."""
    loop, count = border(quads[group == 0]), mix.shape[0]
    n, centre = len(loop), mix[loop].mean(axis=0)
    # the edge has points of its own in the cap, as normals are not smooth around the edge
    fractions = np.arange(CAP_RINGS) / CAP_RINGS
    rings = [csr_array((1 - k) * mix[loop] + k * np.tile(centre, (n, 1))) for k in fractions]
    ring = count + np.arange(CAP_RINGS * n).reshape(CAP_RINGS, n)
    after = np.roll(ring, -1, axis=1)
    between = np.stack([ring[:-1], ring[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    last, middle = ring[-1], np.full(n // 2, count + CAP_RINGS * n)
    inner = np.stack([last[0::2], middle, np.roll(last, -2)[0::2], last[1::2]], axis=-1)
    caps = np.concatenate([between, inner])
    mix = vstack([mix, *rings, csr_array(centre[None])]).tocsr()
    return Shape(
        np.concatenate([quads, caps]), np.concatenate([group, np.full(len(caps), group.max() + 1)]), mix
    )


def border(quads: Index) -> Index:
    """Return the points of the only border of the mesh in order, with the mesh on the left side."""
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    there = set(map(tuple, sides.tolist()))
    after = {a: b for a, b in there if (b, a) not in there}
    start = min(after)
    loop, point = [start], after.pop(start)
    while point != start:
        loop.append(point)
        point = after.pop(point)
    assert not after and len(loop) % 2 == 0, "one border of pairs of sides"
    return np.array(loop)


def bust(data: Arrays, shape: Shape) -> Arrays:
    """Return the arrays of the bust, except its uv layout; positions of joints follow those of points."""
    joints, published = data["joint_vertices"].astype(np.int64), len(data["positions_dm"])
    rows = np.repeat(np.arange(len(joints)), joints.shape[1])
    means = coo_array(
        (np.full(joints.size, 1 / joints.shape[1]), (rows, joints.ravel())), (len(joints), published)
    )
    mix = vstack([shape.mix, means.tocsr()]).tocsr()
    first, points, deltas = [0], list[Index](), list[Doubles]()
    for index in range(len(data["target_names"])):
        point, delta = displacements(data, index)
        dense = np.zeros((published, 3))
        dense[point] = delta
        moved = np.rint((mix @ dense) / DELTA_UNIT_MM)
        which = np.flatnonzero(moved.any(axis=1))
        points.append(which)
        deltas.append(moved[which])
        first.append(first[-1] + len(which))
    bone, weight = influences(data, shape.mix)
    points_mm = mix @ (MM * data["positions_dm"].astype(np.float64))
    return {
        "positions_mm": points_mm.astype(np.float32),
        "quads": shape.quads.astype(np.uint16),
        "group": shape.group.astype(np.uint8),
        "group_names": np.append(data["group_names"], "cap"),
        "target_names": data["target_names"],
        "target_first": np.array(first, np.int32),
        "target_point": np.concatenate(points).astype(np.uint16),
        "target_delta": np.concatenate(deltas).astype(np.int16),
        "bone_names": np.array(list(BONES)),
        "bone": bone.astype(np.uint8),
        "weight": np.rint(255 * weight).astype(np.uint8),
        "joint_names": data["joint_names"],
    }


def influences(data: Arrays, mix: Any) -> tuple[Index, Doubles]:
    """Return the (n, 4) bone indices and weights of each point."""
    standing = np.array([bone_index(str(name)) for name in data["bone_names"]])
    table = np.zeros((len(data["positions_dm"]), len(BONES)))
    np.add.at(table, (data["weight_vertex"].astype(int), standing[data["weight_bone"]]), data["weight"])
    table = np.asarray(mix @ table)
    order = np.argsort(-table, axis=1, kind="stable")[:, :BONES_PER_POINT]
    weight = np.take_along_axis(table, order, axis=1)
    weight[weight.sum(axis=1) <= 0, 0] = 1.0
    return order, weight / weight.sum(axis=1, keepdims=True)


def bone_index(name: str) -> int:
    """Return the index of the bone that replaces a published bone."""
    for index, kinds in enumerate(BONES.values()):
        if kinds and name.startswith(kinds):
            return index
    return list(BONES).index("head")


if __name__ == "__main__":
    run_script(main)
