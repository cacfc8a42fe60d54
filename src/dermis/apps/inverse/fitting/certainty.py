"""How well a photograph tells each number: standard deviations, and what it cannot tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting import sky
from dermis.apps.inverse.fitting.frames import Frames
from dermis.apps.inverse.fitting.solve import Problem, State
from dermis.apps.inverse.fitting.unknowns import SKIN

Floats = NDArray[np.float64]
_BLOCKS = 16
"""Along the longer side: what the frame gets wrong is alike within one."""
_EDGE = 1e-6
_HELD = 0.5
_ALIKE = 0.95


@dataclass(frozen=True, eq=False)
class Certainty:
    """Of the unknowns by name, all as logarithms or angles.

    sd : standard deviations, from residuals that are alike within blocks of the picture
    held : names whose deviation is more than half of what was believed before, so that the belief says them,
        and those that ended on a limit
    alike : pairs that the photograph cannot tell apart, with their correlation
    singular : values of the derivatives in units of what is believed, largest first
    """

    sd: dict[str, float]
    held: tuple[str, ...]
    alike: tuple[tuple[str, str, float], ...]
    singular: tuple[float, ...]


def names_of(suns: int) -> list[str]:
    """Of all unknowns."""
    turns = [f"sun {k + 1} {way}" for k in range(suns) for way in ("across", "along")]
    return [*(one.name for one in SKIN), *turns, "white red", "white blue"]


def certainty_of(problem: Problem, state: State, slopes: Floats) -> Certainty:
    """By the derivatives where lights follow, and sums over blocks of pixels [White1980]."""
    turns = 2 * len(state.point.suns)
    names, spread = names_of(turns // 2), problem.believed(turns)
    count = len(names) if problem.free_white else len(names) - 2
    J = (slopes * state.weight[..., None]).reshape(-1, len(names))[:, :count]
    free = [k for k in range(len(state.basis)) if k < sky.BASIS or state.strengths[k] > 0.0]
    Q = np.linalg.qr((state.basis[free] * state.weight).reshape(len(free), -1).T)[0]
    J, spread = J - Q @ (Q.T @ J), spread[:count]
    r = (state.residual * state.weight).ravel()
    H = np.linalg.inv(J.T @ J + np.diag(spread**-2.0))
    block = np.repeat(_blocks(problem.frames), 3)
    sums = np.stack([np.bincount(block, column) for column in (J * r[:, None]).T], axis=-1)
    covariance = H @ (sums.T @ sums + np.diag(spread**-2.0)) @ H
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sd, sd)
    ended = _on_limits(state)
    each = zip(names, sd, spread, strict=False)
    held = tuple(name for name, one, before in each if one > _HELD * before or name in ended)
    alike = tuple(
        (names[a], names[b], float(correlation[a, b]))
        for a in range(count)
        for b in range(a)
        if abs(correlation[a, b]) > _ALIKE and names[a][:5] != names[b][:5]
    )
    singular = np.linalg.svd(J * spread, compute_uv=False)
    told = dict(zip(names, map(float, sd), strict=False))
    return Certainty(told, held, alike, tuple(map(float, singular)))


def _on_limits(state: State) -> set[str]:
    """Names of the skin's numbers that ended as low or as high as they may."""
    found = state.point.values()
    return {one.name for one in SKIN if not one.low * (1 + _EDGE) < found[one.name] < one.high * (1 - _EDGE)}


def _blocks(frames: Frames) -> NDArray[np.int64]:
    """(p,) number of each pixel's block."""
    rows, columns = np.nonzero(frames.mask)
    side = max(1, max(frames.mask.shape) // _BLOCKS)
    return np.asarray(rows // side * (_BLOCKS * 2) + columns // side, np.int64)
