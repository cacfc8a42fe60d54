"""Edges of light on exported skin in Mitsuba: a half-lit plane against the curve and the prediction.

A plane of the exported medium lies under a lamp that covers half of it and all but touches it. Seen along the
normal, what leaves at a distance from the lamp's edge is the edge response of the profile, by reciprocity.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.fitting import fit_burley_width
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.export.target import get_numbers
from dermis.apps.export.targets.mitsuba.scene import (
    BOUNDARIES,
    Boundary,
    IsotropicMedium,
    medium_description,
    surface_description,
)
from dermis.apps.export.targets.mitsuba.target import TARGET
from dermis.apps.truths.mitsuba_scene import load_mitsuba, mitsuba_variant
from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject, rgb
from dermis.apps.validation.pages import RESULTS, JsonObject, write_results
from dermis.optics.cumulative_profile import CumulativeProfile

Floats = NDArray[np.float64]
FIGURES = RESULTS / "engines_mitsuba.json"
SKINS: dict[str, tuple[Boundary, ...]] = {
    "skin1": ("matched", "smooth"),
    "skin2": ("matched", "smooth", "rough"),
    "dj3": ("matched", "smooth"),
}
"""Skins with the surfaces under which each is measured."""
_HALF_WIDTH_D, _PIXEL_COUNT, _PASS_COUNT, _SUBSAMPLES = 3.0, 8, 8, 16
_LAMP_HEIGHT_D = 0.01  # height of the lamp, by d
_PLANE_HALF_SIDE_D = 500.0
_BLACK_ALBEDO = 1e-9


def half_lit_plane(
    mi: Mitsuba, medium: IsotropicMedium, boundary: Boundary, d_mm: float, *, black: bool = False
) -> MitsubaObject:
    """Return the plane z = 0, lit where x > 0, seen along the normal within `_REACH` d of the edge.

    The camera looks from under the surface where that sends light on along the normal anyway.
    """
    turn = mi.ScalarTransform4f
    size, height = _PLANE_HALF_SIDE_D * d_mm, _LAMP_HEIGHT_D * d_mm
    albedo = (_BLACK_ALBEDO,) * 3 if black else medium.albedo
    inside = mi.load_dict(medium_description(IsotropicMedium(medium.sigma_t, albedo)))
    below = boundary != "rough"
    eye = -1e-3 * height if below else 0.5 * height
    over = turn().translate([size, 0.0, height]).rotate([1, 0, 0], 180).scale([size, size, 1.0])
    look = turn().look_at([0, 0, eye], [0, 0, -1], [0, 1, 0]).scale([_HALF_WIDTH_D * d_mm, _HALF_WIDTH_D * d_mm, 1.0])
    film = {"type": "hdrfilm", "width": _PIXEL_COUNT, "height": 1, "pixel_format": "rgb"}
    sensor = {
        "type": "orthographic",
        "near_clip": 1e-9,
        "far_clip": 1e6,
        "to_world": look,
        "film": {**film, "component_format": "float32", "rfilter": {"type": "box"}},
        "sampler": {"type": "independent"},
    }
    skin = {"type": "rectangle", "to_world": turn().scale([size, size, 1.0]), "interior": inside}
    dark = {"type": "diffuse", "reflectance": rgb((0, 0, 0))}
    lamp = {"type": "rectangle", "to_world": over, "bsdf": dark}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "volpath", "rr_depth": 400},
            "sensor": {**sensor, **({"medium": inside} if below else {})},
            "skin": {**skin, "bsdf": surface_description(boundary)},
            "lamp": {**lamp, "emitter": {"type": "area", "radiance": rgb((1, 1, 1))}},
        }
    )


def measured_edge(
    mi: Mitsuba, medium: IsotropicMedium, boundary: Boundary, d_mm: float, samples: int
) -> tuple[Floats, Floats, float]:
    """Return the edge response at the pixels, its standard errors, and what leaves far inside the light."""
    built = half_lit_plane(mi, medium, boundary, d_mm)
    each = samples // _PASS_COUNT
    seen = np.array([np.array(mi.render(built, spp=each, seed=k))[0].mean(axis=1) for k in range(_PASS_COUNT)])
    if boundary == "rough":  # what the surface itself reflects
        bare = half_lit_plane(mi, medium, boundary, d_mm, black=True)
        lit = np.array(mi.render(bare, spp=samples, seed=99))[0].mean(axis=1)
        seen -= np.where(np.arange(_PIXEL_COUNT) >= _PIXEL_COUNT // 2, lit[_PIXEL_COUNT // 2 :].mean(), 0.0)
    # The two sides of the edge add up to the whole, everywhere.
    both = seen + seen[:, ::-1]
    whole = float(both.mean())
    response = 0.5 + 0.5 * (seen - seen[:, ::-1]) / whole
    return response.mean(axis=0), response.std(axis=0, ddof=1) / np.sqrt(_PASS_COUNT), whole


def pixel_averages(curve: CumulativeProfile, channel: int, d_mm: float) -> Floats:
    """Return a curve's edge response as the mean over each pixel."""
    edges = np.linspace(-_HALF_WIDTH_D, _HALF_WIDTH_D, _PIXEL_COUNT + 1) * d_mm
    at = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(_SUBSAMPLES) + 0.5) / _SUBSAMPLES
    return np.asarray(curve.edge_response(at)[..., channel].mean(axis=1))


def measure_skin(mi: Mitsuba, subject: Subject, boundary: Boundary, samples: int) -> JsonObject:
    """Return the figures of a skin under a surface: differences in red, green and blue."""
    target = TARGET.with_variant(boundary)
    version = target.resolve_version(None)
    rows = target.parameters(subject, version)
    shown, d = target.predicted_curve(rows, subject, version), fit_burley_width(subject.curve)
    measures: dict[str, list[Any]] = {
        key: [] for key in ("predicted", "exported", "noise", "rms", "energy", "edge")
    }
    for c in range(3):
        sigma, albedo = (get_numbers(rows, name)[c] for name in ("sigma_t", "albedo"))
        medium = IsotropicMedium((sigma,) * 3, (albedo,) * 3)
        found, error, whole = measured_edge(mi, medium, boundary, float(d[c]), samples)
        fault = found - pixel_averages(shown, c, float(d[c]))
        measures["predicted"].append(float(np.abs(fault).max()))
        measures["exported"].append(float(np.abs(found - pixel_averages(subject.curve, c, float(d[c]))).max()))
        measures["noise"].append(float(error.mean()))
        measures["rms"].append(float(np.sqrt((fault**2).mean())))
        # Radiance seen from inside is larger by the index squared.
        measures["energy"].append(whole / (BOUNDARIES[boundary] ** 2 if boundary != "rough" else 1.0))
        measures["edge"].append([float(value) for value in found[_PIXEL_COUNT // 2 :]])
    return {"skin": subject.name, "boundary": boundary, "d_mm": [float(x) for x in d], **measures}


def mitsuba(*, samples: int = 32000, output: Path = FIGURES, variant: str = "scalar_rgb") -> None:
    """Measure edges of light on all skins under all surfaces and write the figures.

    Parameters
    ----------
    samples:
        Paths through each pixel.
    output:
        JSON file.
    variant:
        Of Mitsuba.
    """
    mi = load_mitsuba()
    found = []
    with mitsuba_variant(mi, variant):
        for name, boundaries in SKINS.items():
            subject = load_subject(name)
            found += [measure_skin(mi, subject, boundary, samples) for boundary in boundaries]
    half = _PIXEL_COUNT // 2
    at = [(k + 0.5) * _HALF_WIDTH_D / half for k in range(half)]
    how = {"mitsuba": mi.__version__, "samples": samples, "pixels": _PIXEL_COUNT, "at_d": at}
    write_results(output, {**how, "edges": found}, 4)
