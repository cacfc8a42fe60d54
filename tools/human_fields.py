"""Make src/dermis/human/data/average.npz: the average person, and distances of skin from lips and lids.

FOLDER contains the published human.npz and its masks (CC0).
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from human_data import MM, Arrays, Doubles, Index, displacements
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import map_coordinates
from scipy.sparse import csr_array, vstack
from scipy.sparse.linalg import lsqr
from scipy.spatial import cKDTree

from dermis.base.command_line import run_script
from dermis.human.makehuman import DELTA_UNIT_MM, mesh_point_count, morphed_points_mm
from dermis.human.person import Human
from dermis.human.skin.surface import BORDER_FIELDS
from dermis.mesh.mesh import Mesh

OUT = Path(__file__).parent.parent / "src" / "dermis" / "human" / "data" / "average.npz"
AVERAGE = Human(sex=0.5, age=35.0)
"""Person on whom skin is painted; left and right are symmetric."""
LEVEL = 3
"""Level of the subdivision on which distances are measured."""
FARTHEST_MM = 25.0
"""Distance at which fields end; nothing is painted farther from a border."""
PRIOR_WEIGHT = 0.05
"""Weight of the initial value of a control point in the fit, which determines points without influence."""
ROOT_MM = 1.5
"""Largest distance of the roots of lash strips from the skin."""


def main(folder: Path) -> None:
    """Compute the fields and write the file."""
    head = AVERAGE.head(layout="hm08", subdivide=LEVEL)
    assert head.rig is not None and head.rig.stencils is not None
    stencils = head.rig.stencils
    places = morphed_points_mm(AVERAGE.target_weights())[
        : mesh_point_count()
    ]  # with the published lids, which the strips of lashes fit
    points = stencils.points(np.concatenate([places, head.positions_mm[mesh_point_count() :]]))
    mesh = replace(head.mesh, positions=points[head.mesh.point].astype(np.float32))
    skin = skin_vertices(mesh)
    masks = {name: mask(folder, name, mesh.uv) for name in ("lips", "inside-mouth")}
    inside = masks["inside-mouth"]
    found = {
        "lips": signed_distance(mesh, skin, np.where(inside > 0.5, 1.0, masks["lips"]), ignored=inside > 0.5),
        "mouth": -signed_distance(mesh, skin, inside),
        "lids": distance_to(mesh, lash_roots(folder, mesh, skin)),
    }
    assert tuple(found) == BORDER_FIELDS
    values = np.stack([np.clip(one, -FARTHEST_MM, FARTHEST_MM) for one in found.values()], axis=1)
    first, point, weight = stencils.first, stencils.point, stencils.weight
    matrix = csr_array((weight, point, first), shape=(len(first) - 1, len(head.positions_mm)))
    fields = fit(matrix, mesh.point[skin].astype(np.int64), values[skin])
    fields = fields[: mesh_point_count()]  # without eyeballs
    np.savez_compressed(OUT, places=in_hundredths_mm(places), fields=in_hundredths_mm(fields))
    sys.stdout.write(f"{OUT}  {OUT.stat().st_size / 1e3:.0f} kB\n")


def in_hundredths_mm(values_mm: NDArray[np.floating]) -> NDArray[np.int32]:
    """Return values in the unit of the published displacements, as 32 bits: the breast exceeds 16 bits."""
    return np.asarray(np.rint(values_mm / DELTA_UNIT_MM), np.int32)


def skin_vertices(mesh: Mesh) -> Index:
    """Return the indices of the vertices of the skin."""
    kinds = np.array([material.kind == "skin" for material in mesh.materials])
    return np.unique(mesh.triangles[kinds[mesh.material]])


def mask(folder: Path, name: str, uv: NDArray[np.float32]) -> Doubles:
    """Return the (v,) values of a published mask at the vertices, 0 to 1."""
    picture = np.asarray(Image.open(folder / "masks" / f"mpfb_{name}.jpg").convert("L"), np.float64) / 255
    place = uv[:, ::-1].T * np.array(picture.shape)[:, None] - 0.5
    return np.asarray(map_coordinates(picture, place, order=1, mode="nearest"))


def signed_distance(
    mesh: Mesh, skin: Index, share: Doubles, ignored: NDArray[np.bool_] | None = None
) -> Doubles:
    """Return the (v,) signed distance from the contour where a fraction is one half, positive inside [mm].

    ignored : mask of vertices whose edges are not part of the contour
    """
    held = np.zeros(len(share), bool)
    held[skin] = True
    if ignored is not None:
        held &= ~ignored
    edges = np.concatenate([mesh.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    a, b = edges[held[edges].all(axis=1)].T
    crosses = (share[a] > 0.5) != (share[b] > 0.5)
    a, b = a[crosses], b[crosses]
    part = ((0.5 - share[a]) / (share[b] - share[a]))[:, None]
    border = mesh.positions[a] + part * (mesh.positions[b] - mesh.positions[a])
    return np.asarray(np.where(share > 0.5, 1.0, -1.0) * distance_to(mesh, border))


def distance_to(mesh: Mesh, points: Doubles) -> Doubles:
    """Return the (v,) distance of each vertex from the nearest position [mm]."""
    return np.asarray(cKDTree(points).query(mesh.positions)[0])


def lash_roots(folder: Path, mesh: Mesh, skin: Index) -> Doubles:
    """Return (n, 3) points along the edges of the published lash strips that touch the lids [mm]."""
    with np.load(folder / "human.npz") as found:
        data: Arrays = {name: found[name] for name in found}
    names = list(map(str, data["group_names"]))
    strips = [k for k, name in enumerate(names) if "eyelashes" in name]
    quads = data["quads"][np.isin(data["quad_group"], strips)].astype(np.int64)
    places = published_points_mm(data)
    used = np.unique(quads)
    distance = np.full(len(places), np.inf)
    distance[used] = cKDTree(mesh.positions[skin]).query(places[used])[0]
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    sides = sides[(distance[sides] < ROOT_MM).all(axis=1)]
    steps = np.linspace(0.0, 1.0, 8)[:, None, None]
    return np.asarray(((1 - steps) * places[sides[:, 0]] + steps * places[sides[:, 1]]).reshape(-1, 3))


def published_points_mm(data: Arrays) -> Doubles:
    """Return the (p, 3) published points of the average person, relative to the midpoint of the eyes [mm]."""
    names = list(map(str, data["target_names"]))
    places = MM * data["positions_dm"].astype(np.float64)
    for name, weight in AVERAGE.target_weights().items():
        point, delta = displacements(data, names.index(name))
        places[point] += weight * delta
    joints = list(map(str, data["joint_names"]))
    eyes = data["joint_vertices"][[joints.index("l-eye"), joints.index("r-eye")]].astype(np.int64)
    return np.asarray(places - places[eyes].mean(axis=(0, 1)))


def fit(matrix: csr_array, point: Index, values: Doubles) -> Doubles:
    """Return values (p, k) at control points, from which subdivision gives the vertex values (v, k).

    matrix : weights of the control points at each point of the subdivided mesh
    point : (v,) matrix row of each vertex
    """
    rows = matrix[point]
    near = np.asarray(rows.T @ values) / np.maximum(np.asarray(rows.sum(axis=0)).reshape(-1, 1), 1e-9)
    near[np.asarray(rows.sum(axis=0)).ravel() < 1e-9] = -FARTHEST_MM
    n = matrix.shape[1]
    whole = vstack([rows, PRIOR_WEIGHT * csr_array((np.ones(n), (np.arange(n), np.arange(n))))]).tocsr()
    columns = [
        lsqr(whole, np.r_[values[:, k], PRIOR_WEIGHT * near[:, k]], x0=near[:, k], iter_lim=200)[0]
        for k in range(values.shape[1])
    ]
    return np.stack(columns, axis=1)


if __name__ == "__main__":
    run_script(main)
