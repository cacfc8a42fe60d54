"""Make src/dermis/human/data/hm08.npz: all vertices of MakeHuman's base mesh, bound to the skin of the bust.

BASE is MakeHuman's base.obj (CC0), with the vertices of its body and of the helpers of clothes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree
from trimesh.triangles import closest_point, points_to_barycentric

from dermis.base.command_line import run_script
from dermis.human.makehuman import makehuman_arrays, mesh_point_count
from dermis.human.wear.base_mesh import OFFSET_UNIT_MM, WEIGHT_STEPS

OUT = Path(__file__).parent.parent / "src" / "dermis" / "human" / "data" / "hm08.npz"
MM = 100.0  # length of a unit of the published positions
CANDIDATES = 24  # triangles near a vertex of which one is the nearest
SAME_MM = 0.02  # distance at which a vertex is a point of the bust


def main(base: Path) -> None:
    """Bind the vertices to the nearest triangles of the bust and write the file."""
    lines = base.read_text(encoding="utf-8").splitlines()
    vertices = MM * np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float64)
    arrays = makehuman_arrays()
    points = arrays["positions_mm"][: mesh_point_count()].astype(np.float64)
    is_body = arrays["group"] == list(map(str, arrays["group_names"])).index("body")
    quads = arrays["quads"][is_body].astype(np.int64)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [2, 3, 0]]])
    corners = points[triangles]
    near = np.asarray(cKDTree(corners.mean(axis=1)).query(vertices, k=CANDIDATES)[1], np.int64)
    repeated = np.repeat(vertices, CANDIDATES, axis=0)
    hit = closest_point(corners[near.ravel()], repeated)
    best = np.linalg.norm(hit - repeated, axis=1).reshape(near.shape).argmin(axis=1)
    rows = np.arange(len(vertices))
    triangle = near[rows, best]
    weight = points_to_barycentric(corners[triangle], hit.reshape(*near.shape, 3)[rows, best])
    steps = np.rint(WEIGHT_STEPS * weight.clip(0.0, 1.0)).astype(np.int64)
    steps[rows, weight.argmax(axis=1)] += WEIGHT_STEPS - steps.sum(axis=1)
    point = triangles[triangle]
    away, same = (np.asarray(part) for part in cKDTree(points).query(vertices))
    is_point = np.asarray(away < SAME_MM)
    point[is_point], steps[is_point] = same[is_point, None], (WEIGHT_STEPS, 0, 0)
    offset = vertices - np.einsum("nk,nkc->nc", steps / WEIGHT_STEPS, points[point])
    np.savez_compressed(
        OUT,
        point=point.astype(np.uint16),
        weight=steps.astype(np.uint8),
        offset=np.rint(offset / OFFSET_UNIT_MM).astype(np.int16),
    )
    sys.stdout.write(f"{OUT}  {OUT.stat().st_size / 1e6:.2f} MB, {int(is_point.sum())} points of the bust\n")


if __name__ == "__main__":
    run_script(main)
