"""Fit of light and skin to a photograph; a coarse search over suns and pigments finds where to start."""

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
from dermis.apps.inverse.fitting.inputs import FitSubject, Photograph, fit_subject, read_photograph
from dermis.apps.inverse.fitting.light_basis import (
    AMBIENT_LOBE_COUNT,
    solve_normal_equations,
    squared_residual,
)
from dermis.apps.inverse.fitting.placement import align_to_landmarks
from dermis.apps.inverse.fitting.result import FitResult
from dermis.apps.inverse.fitting.solve import (
    ROBUST_LIMIT_SD,
    FitProblem,
    fit_uncertainty,
    light_tint,
    median_block_residual,
    solve_fit,
)
from dermis.apps.inverse.fitting.unknowns import FitUnknowns, prior_unknowns, tangents
from dermis.apps.inverse.unmixing.unknown_skin import FIXED_PARAMETERS, sd_from_assumed_parameters
from dermis.base.errors import format_value, notify, refuse
from dermis.base.quantities import checked_array, checked_integer, checked_number
from dermis.frame.renderer import Renderer
from dermis.human.skin.colours import skin_colour_table
from dermis.mesh.geometry import fibonacci_sphere
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN
from dermis.scene.settings import Settings

_CANDIDATE_SUN_COUNT = 28
_MIN_SUN_COSINE = -0.35  # smallest cosine between sun and camera directions
_MELANIN_GRID, _BLOOD_GRID = np.geomspace(0.002, 0.4, 14), np.geomspace(0.002, 0.06, 8)
_SPECULAR_STRENGTH_GRID = 0.5, 0.75, 1.0
_MAX_RIVAL_RESIDUAL_RATIO, _GRID_NODES_BESIDE_MINIMUM = 2.0, 2
"""A fit also starts at a local minimum of the coarse search if its squared residual is less than the first
number times the smallest squared residual. The second number says how many nodes of the melanin grid
on each side of the minimum this fit may use."""
_SUN_RING_DEGREES, _SUNS_PER_RING = (9.0, 18.0), 6
"""Angular radii of rings around a sun of the coarse search, and number of directions on each ring. The suns
of the coarse search are 35 degrees apart."""
DEFAULT_NOISE = 0.02
DEFAULT_SIDE, DEFAULT_ATLAS, SHADOW_SIZE = 128, 256, 512
_MIN_SKIN_PIXELS = 200
_MAX_BLOCK_RESIDUAL = 0.1
"""Limit of the median relative residual over blocks of a picture [-]. A picture with a larger residual
probably does not show the head, see docs/fit.md."""
WhitePoint = Sequence[float] | Literal["specular"]


def candidate_suns(camera_direction: Floats) -> Floats:
    """Return directions (k, 3) towards possible suns that light the side of the face seen by a camera.

    camera_direction : (3,) unit vector from the face to the camera
    """
    grid = fibonacci_sphere(_CANDIDATE_SUN_COUNT)
    return grid[grid @ camera_direction > _MIN_SUN_COSINE]


def neighbouring_suns(sun_directions: Floats) -> Floats:
    """Return candidate suns (n, 3) for a finer search: each given sun and two rings of suns around it.

    sun_directions : (k, 3) unit vectors towards suns
    """
    azimuth = np.linspace(0.0, 2.0 * np.pi, _SUNS_PER_RING, endpoint=False)
    ring = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    rings = (np.tan(np.radians(angle)) * ring for angle in _SUN_RING_DEGREES)
    offsets = np.concatenate([[[0.0, 0.0]], *rings])
    suns = sun_directions[:, None] + np.einsum("nt,ktc->knc", offsets, tangents(sun_directions))
    return np.asarray((suns / np.linalg.norm(suns, axis=2, keepdims=True)).reshape(-1, 3))


class CoarseSearch:
    """Coarse search for suns and pigments; its result is the start of a fit.

    The diffuse and the specular radiance under each light alone are rendered once. Other pigments and
    specular strengths only scale these radiances, so each trial solves small normal equations without
    rendering.

    face_renderer : renderer of the face
    fit_unknowns : pigments and candidate suns for which the frames are rendered
    photo_radiance : (p, 3) radiance of the photograph's pixels in the mask
    pixel_weight : (p, 3) inverse standard deviations of these pixels
    """

    def __init__(
        self,
        face_renderer: FaceRenderer,
        fit_unknowns: FitUnknowns,
        photo_radiance: Floats,
        pixel_weight: Floats,
    ) -> None:
        self.unknowns = fit_unknowns
        diffuse, specular = face_renderer.diffuse_and_specular_radiance(fit_unknowns)
        weighted = np.concatenate([diffuse, specular]) * pixel_weight
        weighted_target = photo_radiance * pixel_weight
        self._grams = np.einsum("apc,bpc->cab", weighted, weighted, optimize=True)
        self._rights = np.einsum("apc,pc->ca", weighted, weighted_target)
        self._total = float((weighted_target**2).sum())
        self._lights = len(diffuse)
        pigments = face_renderer.scene.skin.pigments
        assert pigments is not None
        fixed = pigments.overrides()
        self._table = skin_colour_table(fixed["eumelanin"], fixed["oxygen"], fixed["epidermis_mm"])

    def best_unknowns(self, sun_count: int, melanin_grid: Floats = _MELANIN_GRID) -> FitUnknowns:
        """Return the pigments, specular strength and `sun_count` suns that have the smallest residual.

        melanin_grid : melanin fractions to try
        """
        log_parameters, suns = self.unknowns.logs, self._select_suns(self.unknowns.logs, sun_count)
        for _ in range(2):
            trials, residuals = self._try_skins(log_parameters, suns, melanin_grid)
            log_parameters = trials[int(np.argmin(residuals))]
            suns = self._select_suns(log_parameters, sun_count)
        return replace(self.unknowns, logs=log_parameters, suns=self.unknowns.suns[suns])

    def melanin_ranges(self, best_unknowns: FitUnknowns) -> list[Floats]:
        """Return a range of melanin fractions around each local minimum of the residual, best first.

        There can be several minima, such as dark skin in strong light and pale skin in weak light. Minima
        with a residual much larger than the smallest residual are left out. If only one minimum remains, its
        range is the whole grid of melanin fractions.

        best_unknowns : result of the method `best_unknowns`, whose suns are used
        """
        suns = [int(np.argmax(self.unknowns.suns @ one)) for one in best_unknowns.suns]
        _, residuals = self._try_skins(best_unknowns.logs, suns, _MELANIN_GRID)
        profile = residuals.reshape(len(_MELANIN_GRID), -1).min(axis=1)
        padded = np.concatenate([[np.inf], profile, [np.inf]])
        is_minimum = (profile <= padded[:-2]) & (profile <= padded[2:])
        usable = np.flatnonzero(is_minimum & (profile < _MAX_RIVAL_RESIDUAL_RATIO * profile.min()))
        if len(usable) == 1:
            return [_MELANIN_GRID]
        ordered = usable[np.argsort(profile[usable])]
        return [
            _MELANIN_GRID[max(k - _GRID_NODES_BESIDE_MINIMUM, 0) : k + _GRID_NODES_BESIDE_MINIMUM + 1]
            for k in ordered
        ]

    def _try_skins(
        self, log_parameters: Floats, sun_indices: list[int], melanin_grid: Floats
    ) -> tuple[list[Floats], Floats]:
        """Return n trial skins, each as 4 logarithms (4,), and the squared residual (n,) of each skin.

        The skins are the nodes of a grid of melanin, blood and specular strength.

        log_parameters : (4,) logarithms of the skin parameters (see `FitUnknowns`); only the roughness is
            used
        sun_indices : indices of the candidate suns
        melanin_grid : melanin fractions to try
        """
        grid = product(np.log(melanin_grid), np.log(_BLOOD_GRID), np.log(_SPECULAR_STRENGTH_GRID))
        trials = [np.array([m, b, log_parameters[2], s]) for m, b, s in grid]
        return trials, np.array([self._squared_residual(one, sun_indices) for one in trials])

    def _select_suns(self, log_parameters: Floats, sun_count: int) -> list[int]:
        """Return the indices of `sun_count` candidate suns, chosen greedily one after the other.

        Each step adds the candidate that gives the smallest residual together with the suns chosen before.

        log_parameters : (4,) logarithms of the skin parameters, see `FitUnknowns`
        """
        selected: list[int] = []
        for _ in range(sun_count):
            remaining = [k for k in range(len(self.unknowns.suns)) if k not in selected]
            selected.append(
                min(remaining, key=lambda k: self._squared_residual(log_parameters, [*selected, k]))
            )
        return selected

    def _squared_residual(self, log_parameters: Floats, sun_indices: list[int]) -> float:
        """Return the squared residual for a skin and a set of suns, minimised over the light strengths.

        The rendered diffuse radiance is scaled to the colour of the skin, and the rendered specular radiance
        to its specular strength.

        log_parameters : (4,) logarithms of the skin parameters, see `FitUnknowns`
        sun_indices : indices of the candidate suns
        """
        lights = np.array([*range(AMBIENT_LOBE_COUNT), *(AMBIENT_LOBE_COUNT + k for k in sun_indices)])
        n, strength = self._lights, float(np.exp(log_parameters[3] - self.unknowns.logs[3]))
        ratio = self._skin_colour(log_parameters) / self._skin_colour(self.unknowns.logs)
        gram, right = np.zeros((len(lights),) * 2), np.zeros(len(lights))
        for c in range(3):
            G, r, s = self._grams[c], self._rights[c], ratio[c]
            diffuse, specular = np.ix_(lights, lights), np.ix_(n + lights, n + lights)
            across = G[np.ix_(lights, n + lights)]
            gram += s**2 * G[diffuse] + s * strength * (across + across.T) + strength**2 * G[specular]
            right += s * r[lights] + strength * r[n + lights]
        return squared_residual(gram, right, self._total, solve_normal_equations(gram, right))

    def _skin_colour(self, log_parameters: Floats) -> Floats:
        melanin, blood = np.exp(log_parameters[:1]), np.exp(log_parameters[1:2])
        return np.asarray(self._table.lookup(melanin, blood)[0], np.float64)


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
    robust: float = ROBUST_LIMIT_SD,
    side: int = DEFAULT_SIDE,
    atlas: int = DEFAULT_ATLAS,
    adapter: str = "auto",
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> FitResult:
    """Fit light and skin to a photograph of a head of known shape.

    All lights have the same colour. The exposure is not estimated, because a photograph does not distinguish
    between a longer exposure and stronger light.

    Parameters
    ----------
    photo : str, Path or array_like
        File (JPEG, HEIC, PNG, TIFF, WebP, AVIF, EXR or HDR), which is turned upright by its EXIF data and
        converted by its colour profile; or an array (h, w, 3) of sRGB bytes or of linear floats.
    head : Scene, Head, Human, str or Path
        A scene or its file (.toml), a head or anything that `load_head` accepts, or a `Human`.
    camera : Camera, str, Path or None
        A camera, or the name of a preset or of a file; None for the camera of the scene.
    landmarks : str, Path or None
        File of landmarks in the photograph. If given, the camera is found from the landmarks, and for a
        `Human` also the shape.
    suns : int
        Number of directional lights besides the ambient light, 0 to 2.
    exposure : float
        Ratio of the photograph's linear values to the radiance [-].
    white : (3,) array_like or "specular"
        Colour of the light in the photograph, or "specular" to estimate it from specular reflection.
    noise : float
        Relative standard deviation of a pixel [-].
    robust : float
        Number of standard deviations beyond which residuals have less weight [Huber1964].
    side : int
        Largest length of the photograph's longer side; a larger photograph is reduced for the fit [pixel].
    atlas : int
        Side of the renderer's atlas [texel].
    adapter : str
        "auto", "cpu" or part of an adapter's name.
    progress : callable
        Function called with the number of finished steps and the number of all steps.

    Returns
    -------
    FitResult
        Light and skin with their uncertainties, and the fitted picture.

    Raises
    ------
    DermisError
        For files and arrays that are not pictures, for numbers out of range, for pictures without skin, and
        when `dermis.Renderer` raises it.

    References
    ----------
    [GolubPereyra1973] and [Kaufman1975] for the least squares, [RamamoorthiHanrahan2001] for the ambient
    light.

    Examples
    --------
    >>> import dermis
    >>> result = dermis.fit("portrait.jpg", "human", landmarks="landmarks.csv")  # doctest: +SKIP
    >>> sorted(result.skin_values)  # doctest: +SKIP
    ['blood', 'melanin', 'rho_s', 'roughness']
    """
    started = time.perf_counter()
    checked_integer("suns", suns, 0, 2)
    exposure = checked_number("exposure", exposure, 1e-6, 1e6, "20 stops either way")
    noise, robust = checked_number("noise", noise, 1e-4, 1.0), checked_number("robust", robust, 0.5, 1e12)
    white_point = _checked_white(white)
    scale = white_point * exposure
    photograph = read_photograph(photo)
    small = photograph.reduced_to(checked_integer("side", side, 32, 1024, "pixels"))
    subject = fit_subject(head, camera)
    if landmarks is not None:
        subject = align_to_landmarks(subject, landmarks, photograph.size)
    settings = Settings(size=small.size, atlas=atlas, shadow_size=SHADOW_SIZE, samples=4, strands=False)
    with TemporaryDirectory() as folder:
        frames = FaceRenderer(Renderer(adapter, cache_size=2), subject.scene, settings, Path(folder))
        candidate = _find_skin(frames, small)
        problem = FitProblem(frames, small.linear[frames.mask] / scale, noise, white == "specular", robust)
        starts = _start_unknowns(problem, candidate, suns)
        found = [solve_fit(problem, start, progress) for start in starts]
        state, derivatives = min(found, key=lambda one: median_block_residual(problem, one[0]))
        scene = frames.lit_scene(state.unknowns, state.strengths)
        picture = frames.render_picture(scene) * scale * light_tint(state.unknowns)
    relative_residual = np.abs(state.residual) / np.maximum(problem.target, 1e-6)
    warn_of_poor_fit(
        photo if isinstance(photo, str | Path) else "photo", median_block_residual(problem, state)
    )
    return FitResult(
        subject,
        state.unknowns,
        state.strengths,
        white_point * light_tint(state.unknowns),
        exposure,
        photograph.size,
        fit_uncertainty(problem, state, derivatives, _sd_from_assumed_parameters(subject, state.unknowns)),
        small.linear,
        picture,
        frames.mask,
        float(np.median(relative_residual)),
        frames.frame_count,
        time.perf_counter() - started,
    )


def _sd_from_assumed_parameters(subject: FitSubject, best_unknowns: FitUnknowns) -> dict[str, float]:
    """Return standard deviations of melanin and blood due to skin parameters that are not fitted.

    The values assumed for these parameters can differ from those of the person. The result is a dictionary
    from pigment name to the standard deviation of the pigment's logarithm.
    """
    pigments = subject.scene.skin.pigments
    assert pigments is not None
    fixed = {name: getattr(pigments, name) for name in ("eumelanin", *FIXED_PARAMETERS)}
    skin = replace(DEFAULT_SKIN, **fixed)
    values = best_unknowns.skin_values()
    return sd_from_assumed_parameters(values["melanin"], values["blood"], skin, subject.known)


def warn_of_poor_fit(photo_source: object, median_residual: float) -> None:
    """Notify the user if a fit is so poor that the picture probably does not show the given head.

    photo_source : name of the photograph, for the notification
    median_residual : median relative residual over blocks of the picture [-]
    """
    if median_residual > _MAX_BLOCK_RESIDUAL:
        notify(
            f"{photo_source}: the fit differs from it by {100 * median_residual:.0f} % (median of blocks); "
            "1 % is usual, up to 10 % for the shape of another person. It probably does not show the head in "
            "this place, "
            "and the results mean nothing: check the camera and that it is upright, or use landmarks"
        )


def _find_skin(face_renderer: FaceRenderer, photo: Photograph) -> FitUnknowns:
    """Set the renderer's mask to the pixels of lit skin; return the unknowns with which the search starts.

    The unknowns are the medians of the priors of the skin parameters, and the directions of all candidate
    suns.
    """
    camera = face_renderer.scene.camera
    view_direction = np.subtract(camera.position, camera.target)
    candidate = prior_unknowns(candidate_suns(view_direction / np.linalg.norm(view_direction)))
    face_renderer.find_mask(candidate, photo.unclipped)
    face_renderer.mask &= photo.linear.max(axis=2) > 0.0
    if face_renderer.mask.sum() < _MIN_SKIN_PIXELS:
        actual = f"only {int(face_renderer.mask.sum())} of its pixels are neither clipped nor black"
        refuse(
            "photo", "skin at the head's position", actual, "Check camera and exposure, or take a larger side"
        )
    return candidate


def _start_unknowns(
    problem: FitProblem, candidate_unknowns: FitUnknowns, sun_count: int
) -> list[FitUnknowns]:
    """Return unknowns at which to start fits, found by a coarse search for suns and a finer one around them.

    There is one result for each melanin fraction at which the residual of the coarse search has a local
    minimum, see `CoarseSearch.melanin_ranges`.

    candidate_unknowns : skin parameters and all candidate suns of the coarse search
    sun_count : number of these candidate suns that each result keeps
    """
    frames, target, weight = problem.frames, problem.target, problem.initial_weights()
    coarse = CoarseSearch(frames, candidate_unknowns, target, weight)
    best = coarse.best_unknowns(sun_count)
    starts = []
    for melanin in coarse.melanin_ranges(best):
        start = coarse.best_unknowns(sun_count, melanin)
        if sun_count:
            nearer = replace(start, suns=neighbouring_suns(start.suns))
            start = CoarseSearch(frames, nearer, target, weight).best_unknowns(sun_count, melanin)
        starts.append(start)
    return starts


def _checked_white(white_point: WhitePoint) -> Floats:
    """Return the light's colour (3,) that the user gives, scaled to green 1; for "specular", (1, 1, 1).

    Raises DermisError for any other value.
    """
    if isinstance(white_point, str):
        if white_point != "specular":
            actual = f"got {format_value(white_point)}"
            refuse("white", '"specular" or red, green and blue', actual, "Write white=(1, 1, 1)")
        return np.ones(3)
    colour = checked_array("white", white_point, (3,), 0.01, 100.0)
    return np.asarray(colour / colour[1], np.float64)
