"""Initial guess of a fit: the best of a coarse grid of sun directions and pigments."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.inverse.fitting.frames import FaceRenderer
from dermis.apps.inverse.fitting.inputs import Photograph, read_photograph, fit_subject
from dermis.apps.inverse.fitting.light_basis import BASIS, squared_residual, solve_normal_equations
from dermis.apps.inverse.fitting.placement import align_to_landmarks
from dermis.apps.inverse.fitting.result import FitResult
from dermis.apps.inverse.fitting.solve import ROBUST_LIMIT, FitProblem, fit_uncertainty, solve_fit, light_tint
from dermis.apps.inverse.fitting.unknowns import SKIN_UNKNOWNS, FitPoint, tangents, prior_point
from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_array, checked_integer, checked_number
from dermis.frame.renderer import Renderer
from dermis.human.skin.painted import skin_colour_table
from dermis.mesh.geometry import fibonacci_sphere
from dermis.optics.media import Floats
from dermis.scene.settings import Settings

_SUN_COUNT = 28
_MIN_SUN_COSINE = -0.35  # along z: suns farther behind leave the face dark
_MELANIN_GRID, _BLOOD_GRID = np.geomspace(0.002, 0.4, 14), np.geomspace(0.002, 0.06, 8)
_STRENGTH_GRID = 0.5, 0.75, 1.0
_RING_DEGREES, _RING_DIRECTIONS = (9.0, 18.0), 6  # degrees, and directions on each; those tried first are 35 degrees apart
DEFAULT_NOISE = 0.02
DEFAULT_SIDE, DEFAULT_ATLAS, SHADOW_SIZE = 128, 256, 512
_MIN_PIXELS = 200
WhitePoint = Sequence[float] | Literal["specular"]


def candidate_suns(towards_camera: Floats) -> Floats:
    """Return directions (k, 3) around a camera from which a sun lights the face.

    towards_camera : (3,) unit vector
    """
    every = fibonacci_sphere(_SUN_COUNT)
    return every[every @ towards_camera > _MIN_SUN_COSINE]


def neighbouring_suns(towards: Floats) -> Floats:
    """Return directions (k, 3) and others around them, at half the distance of those tried first."""
    turn = np.linspace(0.0, 2.0 * np.pi, _RING_DIRECTIONS, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    off = np.concatenate([[[0.0, 0.0]], *(np.tan(np.radians(angle)) * ring for angle in _RING_DEGREES)])
    found = towards[:, None] + np.einsum("nt,ktc->knc", off, tangents(towards))
    return np.asarray((found / np.linalg.norm(found, axis=2, keepdims=True)).reshape(-1, 3))


class InitialGuess:
    """Normal equations of the radiance under each light alone, below the surface and off it.

    frames, point : the face, its `suns` being those to try
    target : (p, 3) the photograph's radiance
    weight : (p, 3)
    """

    def __init__(self, frames: FaceRenderer, point: FitPoint, target: Floats, weight: Floats) -> None:
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
        held = pigments.overrides()
        self._table = skin_colour_table(held["eumelanin"], held["oxygen"], held["epidermis_mm"])

    def best(self, count: int) -> FitPoint:
        """Return the best point with `count` suns."""
        every = list(product(np.log(_MELANIN_GRID), np.log(_BLOOD_GRID), np.log(_STRENGTH_GRID)))
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
        return squared_residual(gram, right, self._total, solve_normal_equations(gram, right))

    def _colour(self, logs: Floats) -> Floats:
        shares = np.exp(logs[: len(SKIN_UNKNOWNS)])
        return np.asarray(self._table.lookup(shares[:1], shares[1:2])[0], np.float64)


def fit(
    photo: str | Path | ArrayLike,
    head: object = "human",
    *,
    camera: object = None,
    landmarks: str | Path | None = None,
    suns: int = 1,
    exposure: float = 1.0,
    white: WhitePoint = (1.0, 1.0, 1.0),
    noise: float = DEFAULT_NOISE,
    robust: float = ROBUST_LIMIT,
    side: int = DEFAULT_SIDE,
    atlas: int = DEFAULT_ATLAS,
    adapter: str = "auto",
    told: Callable[[int, int], None] = lambda done, of: None,
) -> FitResult:
    """Fit light and skin to a photograph of a head whose shape and camera are known.

    photo : a file (PNG, JPEG or TIFF in sRGB, EXR linear), or pixels (h, w, 3): bytes in sRGB, floats linear
    head : a scene or its file (.toml), a head or what `load_head` takes, a `Human`
    camera : a camera, a preset's name or a file; the scene's own when left out
    landmarks : file of landmarks in the photograph, by which camera and the human's shape are found
    suns : lights from one direction beside the light from all around, 0 to 2
    exposure : factor from radiance to the photograph
    white : colour of the light in the photograph, or "specular" to find it from what the surface mirrors
    noise : relative standard deviation of a pixel
    robust : standard deviations from which a pixel that cannot be explained counts less
    side : pixels along the longer side at which it is fitted
    atlas : side of the renderer's atlas [texel]
    told : steps done of how many

    All light has one colour. Its strength is found, and exposure is one number with it: a photograph cannot
    tell the two apart.

    Raises DermisError for what is no picture, numbers that cannot be, pictures without skin, and as
    `dermis.Renderer`.
    """
    began = time.perf_counter()
    checked_integer("suns", suns, 0, 2)
    exposure = checked_number("exposure", exposure, 1e-6, 1e6, "20 stops either way")
    noise, robust = checked_number("noise", noise, 1e-4, 1.0), checked_number("robust", robust, 0.5, 1e12)
    given = _checked_white(white)
    scale = given * exposure
    whole = read_photograph(photo)
    small = whole.within(checked_integer("side", side, 32, 1024, "pixels"))
    subject = fit_subject(head, camera)
    if landmarks is not None:
        subject = align_to_landmarks(subject, landmarks, whole.size)
    settings = Settings(
        size=small.size, atlas=atlas, shadow_size=SHADOW_SIZE, samples=4, strands=False, technique="texture-space"
    )
    with TemporaryDirectory() as folder:
        frames = FaceRenderer(Renderer(adapter, cache_size=2), subject.scene, settings, Path(folder))
        tried = _find_skin(frames, small)
        problem = FitProblem(frames, small.linear[frames.mask] / scale, noise, white == "specular", robust)
        state, slopes = solve_fit(problem, _initial_point(problem, tried, suns), told)
        scene = frames.lit(state.point, state.strengths)
        picture = frames.picture(scene) * scale * light_tint(state.point)
    off = np.abs(state.residual) / np.maximum(problem.target, 1e-6)
    return FitResult(
        subject,
        state.point,
        state.strengths,
        given * light_tint(state.point),
        exposure,
        whole.size,
        fit_uncertainty(problem, state, slopes),
        small.linear,
        picture,
        frames.mask,
        float(np.median(off)),
        frames.drawn,
        time.perf_counter() - began,
    )


def _find_skin(frames: FaceRenderer, photo: Photograph) -> FitPoint:
    """Find the pixels of lit skin, and return the usual point with the suns to try."""
    camera = frames.scene.camera
    way = np.subtract(camera.position, camera.target)
    tried = prior_point(candidate_suns(way / np.linalg.norm(way)))
    frames.find_mask(tried, photo.trusted)
    frames.mask &= photo.linear.max(axis=2) > 0.0
    if frames.mask.sum() < _MIN_PIXELS:
        actual = f"{int(frames.mask.sum())} pixels of it are neither clipped nor black"
        refuse("photo", "skin where the head is", actual, "Check camera and exposure, or take a larger side")
    return tried


def _initial_point(problem: FitProblem, tried: FitPoint, suns: int) -> FitPoint:
    """Return the point at which the fit starts: a coarse search, then a finer one around its suns."""
    frames, target, weight = problem.frames, problem.target, problem.even_weights()
    start = InitialGuess(frames, tried, target, weight).best(suns)
    if suns:
        nearer = replace(start, suns=neighbouring_suns(start.suns))
        start = InitialGuess(frames, nearer, target, weight).best(suns)
    return start


def _checked_white(white: WhitePoint) -> Floats:
    """Return the given white (3,), green 1."""
    if isinstance(white, str):
        if white != "specular":
            actual = f"got {format_value(white)}"
            refuse("white", '"specular" or red, green and blue', actual, "Write white=(1, 1, 1)")
        return np.ones(3)
    found = checked_array("white", white, (3,), 0.01, 100.0)
    return np.asarray(found / found[1], np.float64)
