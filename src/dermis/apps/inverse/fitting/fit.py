"""Fit of light and skin to a photograph of a face, with the renderer as the forward model."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.inverse.fitting.frames import Frames
from dermis.apps.inverse.fitting.initial_guess import InitialGuess, suns_around, suns_to_try
from dermis.apps.inverse.fitting.inputs import Photograph, read_photograph, subject_of
from dermis.apps.inverse.fitting.placement import place_by_landmarks
from dermis.apps.inverse.fitting.result import FitResult
from dermis.apps.inverse.fitting.solve import ROBUST, Problem, certainty_of, solve, tint
from dermis.apps.inverse.fitting.unknowns import Point, usual_point
from dermis.base.errors import refuse, shown_value
from dermis.base.quantities import number, numbers, whole_number
from dermis.frame.renderer import Renderer
from dermis.optics.media import Floats
from dermis.scene.settings import Settings

NOISE = 0.02
SIDE, ATLAS, SHADOWS = 128, 256, 512
_LEAST_PIXELS = 200
White = Sequence[float] | Literal["specular"]


def fit(
    photo: str | Path | ArrayLike,
    head: object = "human",
    *,
    camera: object = None,
    landmarks: str | Path | None = None,
    suns: int = 1,
    exposure: float = 1.0,
    white: White = (1.0, 1.0, 1.0),
    noise: float = NOISE,
    robust: float = ROBUST,
    side: int = SIDE,
    atlas: int = ATLAS,
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
    whole_number("suns", suns, 0, 2)
    exposure = number("exposure", exposure, 1e-6, 1e6, "20 stops either way")
    noise, robust = number("noise", noise, 1e-4, 1.0), number("robust", robust, 0.5, 1e12)
    given = _white(white)
    scale = given * exposure
    whole = read_photograph(photo)
    small = whole.within(whole_number("side", side, 32, 1024, "pixels"))
    subject = subject_of(head, camera)
    if landmarks is not None:
        subject = place_by_landmarks(subject, landmarks, whole.size)
    settings = Settings(
        size=small.size, atlas=atlas, shadow_size=SHADOWS, samples=4, strands=False, technique="texture-space"
    )
    with TemporaryDirectory() as folder:
        frames = Frames(Renderer(adapter, depth=2), subject.scene, settings, Path(folder))
        tried = _find_skin(frames, small)
        problem = Problem(frames, small.linear[frames.mask] / scale, noise, white == "specular", robust)
        state, slopes = solve(problem, _start(problem, tried, suns), told)
        scene = frames.lit(state.point, state.strengths)
        picture = frames.picture(scene) * scale * tint(state.point)
    off = np.abs(state.residual) / np.maximum(problem.target, 1e-6)
    return FitResult(
        subject,
        state.point,
        state.strengths,
        given * tint(state.point),
        exposure,
        whole.size,
        certainty_of(problem, state, slopes),
        small.linear,
        picture,
        frames.mask,
        float(np.median(off)),
        frames.drawn,
        time.perf_counter() - began,
    )


def _find_skin(frames: Frames, photo: Photograph) -> Point:
    """Find the pixels of lit skin, and return the usual point with the suns to try."""
    camera = frames.scene.camera
    way = np.subtract(camera.position, camera.target)
    tried = usual_point(suns_to_try(way / np.linalg.norm(way)))
    frames.find_mask(tried, photo.trusted)
    frames.mask &= photo.linear.max(axis=2) > 0.0
    if frames.mask.sum() < _LEAST_PIXELS:
        came = f"{int(frames.mask.sum())} pixels of it are neither clipped nor black"
        refuse("photo", "skin where the head is", came, "Check camera and exposure, or take a larger side")
    return tried


def _start(problem: Problem, tried: Point, suns: int) -> Point:
    """Return the point at which the fit starts: a coarse search, then a finer one around its suns."""
    frames, target, weight = problem.frames, problem.target, problem.even_weights()
    start = InitialGuess(frames, tried, target, weight).best(suns)
    if suns:
        nearer = replace(start, suns=suns_around(start.suns))
        start = InitialGuess(frames, nearer, target, weight).best(suns)
    return start


def _white(white: White) -> Floats:
    """Return the given white (3,), green 1."""
    if isinstance(white, str):
        if white != "specular":
            came = f"{shown_value(white)} came"
            refuse("white", '"specular" or red, green and blue', came, "Write white=(1, 1, 1)")
        return np.ones(3)
    found = numbers("white", white, (3,), 0.01, 100.0)
    return np.asarray(found / found[1], np.float64)
