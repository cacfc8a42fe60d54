"""Four bones for each point of a finer mesh, chosen so that turns take it where its control points go."""

from __future__ import annotations

from itertools import chain, combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.rig import Rig
from dermis.mesh.skeleton import INFLUENCES, Skeleton

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

_LEAST = 1e-6  # a share below it is none
_MOST = 8  # bones among which four are chosen
_NEAR_MM2 = 1.0  # how much a share is worth that stays as the control points have it


def influences(rig: Rig, finer: csr_array | None) -> tuple[Index, Doubles]:
    """(q, 4) bones and shares of the points of a mesh; the shares of a point add up to 1.

    finer : (q, p) weights of the control points, None where the mesh has them as they are

    A control point's own are kept. A mean of points that turn differently is no turn of their mean, and may
    follow more than four bones: of all choices that one is taken which comes nearest, by least squares over a
    turn of each bone about any axis.
    """
    skeleton = rig.skeleton
    assert skeleton is not None
    shares = _shares(skeleton)
    if finer is not None:
        shares = _fitted(rig.positions_mm.astype(np.float64), skeleton, shares, finer)
    bone = np.argsort(-shares, axis=1, kind="stable")[:, :INFLUENCES]
    bone = np.pad(bone, ((0, 0), (0, INFLUENCES - bone.shape[1])))
    weight = np.take_along_axis(shares, bone, axis=1)
    weight[:, shares.shape[1] :] = 0.0
    weight /= weight.sum(axis=1, keepdims=True)
    return np.where(weight > 0, bone, 0), weight


def _shares(skeleton: Skeleton) -> Doubles:
    """(p, b) of each bone at each control point."""
    count = len(skeleton.bone)
    shares = np.zeros((count, len(skeleton.names)))
    np.add.at(shares, (np.arange(count)[:, None], skeleton.bone), skeleton.weight)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))


def _fitted(places_mm: Doubles, skeleton: Skeleton, control: Doubles, finer: csr_array) -> Doubles:
    """(q, b) with at most four shares in a row."""
    shares = np.asarray(finer @ control)
    shares[shares < _LEAST] = 0.0
    below = _below(skeleton)
    kinds, kind = np.unique(shares > 0, axis=0, return_inverse=True)
    order = np.argsort(kind.reshape(-1), kind="stable")
    ends = np.cumsum(np.bincount(kind.reshape(-1), minlength=len(kinds)))
    for used, rows in zip(kinds, np.split(order, ends[:-1]), strict=True):
        mean = shares[rows]
        bones = np.flatnonzero(used)
        if len(bones) > 1:
            if len(bones) > _MOST:
                bones = np.sort(np.argsort(-mean.sum(axis=0), kind="stable")[:_MOST])
            hessian, slope = _misses(places_mm, skeleton, control @ below.T, finer[rows], below[:, bones])
            hessian += _NEAR_MM2 * np.eye(len(bones))
            shares[rows] = 0.0
            shares[rows[:, None], bones] = _best(hessian, slope + _NEAR_MM2 * mean[:, bones])
    return shares


def _below(skeleton: Skeleton) -> Doubles:
    """(b, b) 1 where the second bone is the first, or below it."""
    below = np.eye(len(skeleton.names))
    for bone, parent in enumerate(skeleton.parent.tolist()):
        if parent >= 0:
            below[:, bone] += below[:, parent]
    return below


def _misses(
    places_mm: Doubles, skeleton: Skeleton, follow: Doubles, finer: csr_array, below: Doubles
) -> tuple[Doubles, Doubles]:
    """How far points miss, as w H w - 2 g w of their shares w [mm2]: H (n, u, u) and g (n, u).

    follow : (p, b) how much of each bone's turn takes each control point, by bones below too
    below : (b, u) 1 where a bone among which is chosen is another one, or below it
    """
    points = np.asarray(finer @ places_mm)
    hessian = np.zeros((len(points), below.shape[1], below.shape[1]))
    slope = np.zeros(hessian.shape[:2])
    for bone in np.flatnonzero(below.any(axis=1)):
        origin, moved = np.array(skeleton.origin_mm[bone]), below[bone]
        arm = points - origin
        meant = np.asarray(finer @ (follow[:, bone, None] * (places_mm - origin)))
        hessian += (arm**2).sum(axis=1)[:, None, None] * np.outer(moved, moved)
        slope += (arm * meant).sum(axis=1)[:, None] * moved
    return hessian, slope


def _best(hessian: Doubles, slope: Doubles) -> Doubles:
    """(n, u) shares of 0 and more, at most four of them not 0, that add up to 1 and miss least."""
    count, bones = slope.shape
    best, found = np.full(count, np.inf), np.zeros(slope.shape)
    for some in chain.from_iterable(combinations(range(bones), k) for k in range(1, INFLUENCES + 1)):
        chosen = list(some)
        part, side = hessian[:, chosen][:, :, chosen], slope[:, chosen]
        system = np.ones((count, len(chosen) + 1, len(chosen) + 1))
        system[:, :-1, :-1], system[:, -1, -1] = part, 0.0
        right = np.concatenate([side, np.ones((count, 1))], axis=1)
        weight = np.linalg.solve(system, right[..., None])[:, :-1, 0]
        missed = np.einsum("nk,nkl,nl->n", weight, part, weight) - 2 * (side * weight).sum(axis=1)
        better = (weight >= 0).all(axis=1) & (missed < best)
        best[better] = missed[better]
        found[better] = 0.0
        found[np.flatnonzero(better)[:, None], chosen] = weight[better]
    return found
