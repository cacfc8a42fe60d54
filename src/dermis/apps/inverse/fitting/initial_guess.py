"""Initial guess of a fit: the best of a coarse grid of sun directions and pigments."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from dermis.apps.inverse.fitting.frames import Frames
from dermis.apps.inverse.fitting.light_basis import BASIS, fault_by, strengths_by
from dermis.apps.inverse.fitting.unknowns import UNKNOWNS, Point, tangents
from dermis.human.skin.painted import colours
from dermis.mesh.geometry import fibonacci_sphere
from dermis.optics.media import Floats

_AROUND = 28
_BEHIND = -0.35  # along z: suns farther behind leave the face dark
_MELANIN, _BLOOD = np.geomspace(0.002, 0.4, 14), np.geomspace(0.002, 0.06, 8)
_STRENGTH = 0.5, 0.75, 1.0
_RINGS, _RING = (9.0, 18.0), 6  # degrees, and directions on each; those tried first are 35 degrees apart


def suns_to_try(towards_camera: Floats) -> Floats:
    """Return directions (k, 3) around a camera from which a sun lights the face.

    towards_camera : (3,) unit vector
    """
    every = fibonacci_sphere(_AROUND)
    return every[every @ towards_camera > _BEHIND]


def suns_around(towards: Floats) -> Floats:
    """Return directions (k, 3) and others around them, at half the distance of those tried first."""
    turn = np.linspace(0.0, 2.0 * np.pi, _RING, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    off = np.concatenate([[[0.0, 0.0]], *(np.tan(np.radians(angle)) * ring for angle in _RINGS)])
    found = towards[:, None] + np.einsum("nt,ktc->knc", off, tangents(towards))
    return np.asarray((found / np.linalg.norm(found, axis=2, keepdims=True)).reshape(-1, 3))


class InitialGuess:
    """Normal equations of the radiance under each light alone, below the surface and off it.

    frames, point : the face, its `suns` being those to try
    target : (p, 3) the photograph's radiance
    weight : (p, 3)
    """

    def __init__(self, frames: Frames, point: Point, target: Floats, weight: Floats) -> None:
        self.point = point
        below, off = frames.parts(point)
        both = np.concatenate([below, off]) * weight
        wanted = target * weight
        self._grams = np.einsum("apc,bpc->cab", both, both, optimize=True)
        self._rights = np.einsum("apc,pc->ca", both, wanted)
        self._total = float((wanted**2).sum())
        self._lights = len(below)
        pigments = frames.scene.skin.pigments
        assert pigments is not None
        held = pigments.given()
        self._table = colours(held["eumelanin"], held["oxygen"], held["epidermis_mm"])

    def best(self, count: int) -> Point:
        """Return the best point with `count` suns."""
        every = list(product(np.log(_MELANIN), np.log(_BLOOD), np.log(_STRENGTH)))
        at, suns = self.point.logs, self._nearest(self.point.logs, count)
        for _ in range(2):
            trials = [np.array([m, b, at[2], s]) for m, b, s in every]
            at = trials[int(np.argmin([self._fault(one, suns) for one in trials]))]
            suns = self._nearest(at, count)
        return replace(self.point, logs=at, suns=self.point.suns[suns])

    def _nearest(self, logs: Floats, count: int) -> list[int]:
        """Return the suns with the smallest residual, chosen greedily."""
        found: list[int] = []
        for _ in range(count):
            left = [k for k in range(len(self.point.suns)) if k not in found]
            found.append(min(left, key=lambda k: self._fault(logs, [*found, k])))
        return found

    def _fault(self, logs: Floats, suns: list[int]) -> float:
        """Return the squared residual, with radiance below the surface scaled by the colour of the skin, and
        radiance off it by its strength.
        """
        chosen = np.array([*range(BASIS), *(BASIS + k for k in suns)])
        n, strength = self._lights, float(np.exp(logs[3] - self.point.logs[3]))
        ratio = self._colour(logs) / self._colour(self.point.logs)
        gram, right = np.zeros((len(chosen),) * 2), np.zeros(len(chosen))
        for c in range(3):
            G, r, s = self._grams[c], self._rights[c], ratio[c]
            below, off = np.ix_(chosen, chosen), np.ix_(n + chosen, n + chosen)
            across = G[np.ix_(chosen, n + chosen)]
            gram += s**2 * G[below] + s * strength * (across + across.T) + strength**2 * G[off]
            right += s * r[chosen] + strength * r[n + chosen]
        return fault_by(gram, right, self._total, strengths_by(gram, right))

    def _colour(self, logs: Floats) -> Floats:
        shares = np.exp(logs[: len(UNKNOWNS)])
        return np.asarray(self._table.read(shares[:1], shares[1:2])[0], np.float64)
