"""Edge responses of exported skin in Mitsuba: light scattered across the edge of a half-lit plane.

The exported medium has a flat surface. A lamp that almost touches the surface lights one half of it. By
reciprocity, the radiance along the normal, at each distance from the lamp's edge, is the edge response of the
diffusion profile.
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
    IOR_BY_SURFACE_MODEL,
    IsotropicMedium,
    SurfaceModel,
    medium_description,
    surface_bsdf,
)
from dermis.apps.export.targets.mitsuba.target import TARGET
from dermis.apps.truths.mitsuba_scene import load_mitsuba, mitsuba_variant
from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject, mitsuba_rgb
from dermis.apps.validation.pages import RESULTS, JsonObject, write_results
from dermis.optics.cumulative_profile import CumulativeProfile

Floats = NDArray[np.float64]
RESULTS_FILE = RESULTS / "engines_mitsuba.json"
COMPARED_SKINS: dict[str, tuple[SurfaceModel, ...]] = {
    "skin1": ("matched", "smooth"),
    "skin2": ("matched", "smooth", "rough"),
    "dj3": ("matched", "smooth"),
}
"""Surface models for which each skin is measured, by name of the skin."""
# half the width of the view [Burley widths]; numbers of pixels, of rendering passes, and of samples per pixel
_VIEW_HALF_WIDTH_PER_BURLEY_WIDTH, _PIXEL_COUNT, _PASS_COUNT, _SAMPLES_PER_PIXEL_AVERAGE = 3.0, 8, 8, 16
_LAMP_HEIGHT_PER_BURLEY_WIDTH = 0.01
_PLANE_HALF_SIDE_PER_BURLEY_WIDTH = 500.0
_BLACK_ALBEDO = 1e-9


def half_lit_plane(
    mi: Mitsuba,
    medium: IsotropicMedium,
    surface_model: SurfaceModel,
    burley_width_mm: float,
    *,
    is_black: bool = False,
) -> MitsubaObject:
    """Return a scene of the plane z = 0, lit where x > 0, in an orthographic view around the edge.

    The camera looks down on a rough surface. If the surface is smooth or absent, the camera is in the medium
    just below the plane; light along the normal crosses such a surface undeflected.

    mi : module mitsuba
    medium : medium below the plane
    surface_model : surface of the medium: "matched" for none, "smooth" or "rough"
    burley_width_mm : Burley width d of the profile; the view spans 3 d on each side of the edge [mm]
    is_black : whether the medium absorbs all light, so that only the surface reflects
    """
    transform = mi.ScalarTransform4f
    size, height = (
        _PLANE_HALF_SIDE_PER_BURLEY_WIDTH * burley_width_mm,
        _LAMP_HEIGHT_PER_BURLEY_WIDTH * burley_width_mm,
    )
    albedo = (_BLACK_ALBEDO,) * 3 if is_black else medium.albedo
    inside = mi.load_dict(medium_description(IsotropicMedium(medium.sigma_t, albedo)))
    camera_below = surface_model != "rough"
    eye = -1e-3 * height if camera_below else 0.5 * height
    lamp_to_world = transform().translate([size, 0.0, height]).rotate([1, 0, 0], 180).scale([size, size, 1.0])
    scale = [
        _VIEW_HALF_WIDTH_PER_BURLEY_WIDTH * burley_width_mm,
        _VIEW_HALF_WIDTH_PER_BURLEY_WIDTH * burley_width_mm,
        1.0,
    ]
    camera_to_world = transform().look_at([0, 0, eye], [0, 0, -1], [0, 1, 0]).scale(scale)
    film = {"type": "hdrfilm", "width": _PIXEL_COUNT, "height": 1, "pixel_format": "rgb"}
    sensor = {
        "type": "orthographic",
        "near_clip": 1e-9,
        "far_clip": 1e6,
        "to_world": camera_to_world,
        "film": {**film, "component_format": "float32", "rfilter": {"type": "box"}},
        "sampler": {"type": "independent"},
    }
    skin = {"type": "rectangle", "to_world": transform().scale([size, size, 1.0]), "interior": inside}
    black_bsdf = {"type": "diffuse", "reflectance": mitsuba_rgb((0, 0, 0))}
    lamp = {"type": "rectangle", "to_world": lamp_to_world, "bsdf": black_bsdf}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "volpath", "rr_depth": 400},
            "sensor": {**sensor, **({"medium": inside} if camera_below else {})},
            "skin": {**skin, "bsdf": surface_bsdf(surface_model)},
            "lamp": {**lamp, "emitter": {"type": "area", "radiance": mitsuba_rgb((1, 1, 1))}},
        }
    )


def measured_edge_response(
    mi: Mitsuba, medium: IsotropicMedium, surface_model: SurfaceModel, burley_width_mm: float, samples: int
) -> tuple[Floats, Floats, float]:
    """Measure the light scattered across the edge of a half-lit plane in Mitsuba.

    Returns the edge response (n,) averaged over each pixel, its standard errors (n,), and the radiance in the
    lit area far from the edge.

    mi : module mitsuba
    medium : medium below the plane
    surface_model : surface of the medium: "matched" for none, "smooth" or "rough"
    burley_width_mm : Burley width of the profile [mm]
    samples : paths per pixel
    """
    plane = half_lit_plane(mi, medium, surface_model, burley_width_mm)
    passes = [mi.render(plane, spp=samples // _PASS_COUNT, seed=k) for k in range(_PASS_COUNT)]
    images = np.array([np.array(image)[0].mean(axis=1) for image in passes])
    if surface_model == "rough":  # subtract what the surface reflects
        black_scene = half_lit_plane(mi, medium, surface_model, burley_width_mm, is_black=True)
        lit = np.array(mi.render(black_scene, spp=samples, seed=99))[0].mean(axis=1)
        images -= np.where(np.arange(_PIXEL_COUNT) >= _PIXEL_COUNT // 2, lit[_PIXEL_COUNT // 2 :].mean(), 0.0)
    # At every distance, the two sides of the edge add up to the same total.
    both_sides = images + images[:, ::-1]
    total = float(both_sides.mean())
    response = 0.5 + 0.5 * (images - images[:, ::-1]) / total
    return response.mean(axis=0), response.std(axis=0, ddof=1) / np.sqrt(_PASS_COUNT), total


def pixel_edge_response(
    cumulative_profile: CumulativeProfile, channel: int, burley_width_mm: float
) -> Floats:
    """Return the predicted edge response (n,) of one channel of a profile, averaged over each pixel.

    cumulative_profile : cumulative form of the profile
    channel : index of the channel
    burley_width_mm : Burley width of the profile, which sets the size of the view [mm]
    """
    edges = (
        np.linspace(-_VIEW_HALF_WIDTH_PER_BURLEY_WIDTH, _VIEW_HALF_WIDTH_PER_BURLEY_WIDTH, _PIXEL_COUNT + 1)
        * burley_width_mm
    )
    centres = (
        edges[:-1, None]
        + np.diff(edges)[:, None] * (np.arange(_SAMPLES_PER_PIXEL_AVERAGE) + 0.5) / _SAMPLES_PER_PIXEL_AVERAGE
    )
    return np.asarray(cumulative_profile.edge_response(centres)[..., channel].mean(axis=1))


def measure_skin(mi: Mitsuba, subject: Subject, surface_model: SurfaceModel, samples: int) -> JsonObject:
    """Return the measured edge responses of an exported skin, and their errors, by channel.

    An edge response is the radiance of a half-lit plane by distance from the edge of the lit half.

    mi : module mitsuba
    surface_model : surface of the skin: "matched" for none, "smooth" or "rough"
    samples : paths per pixel
    """
    target = TARGET.with_variant(surface_model)
    version = target.resolve_version(None)
    rows = target.parameters(subject, version)
    predicted, d = target.predicted_profile(rows, subject, version), fit_burley_width(subject.curve)
    keys = "predicted", "exported", "noise", "rms", "energy", "edge"
    results: dict[str, list[Any]] = {key: [] for key in keys}
    for c in range(3):
        sigma, albedo = (get_numbers(rows, name)[c] for name in ("sigma_t", "albedo"))
        medium = IsotropicMedium((sigma,) * 3, (albedo,) * 3)
        edge, error, total = measured_edge_response(mi, medium, surface_model, float(d[c]), samples)
        difference = edge - pixel_edge_response(predicted, c, float(d[c]))
        results["predicted"].append(float(np.abs(difference).max()))
        results["exported"].append(
            float(np.abs(edge - pixel_edge_response(subject.curve, c, float(d[c]))).max())
        )
        results["noise"].append(float(error.mean()))
        results["rms"].append(float(np.sqrt((difference**2).mean())))
        # Radiance inside the medium is larger by the square of the index.
        results["energy"].append(
            total / (IOR_BY_SURFACE_MODEL[surface_model] ** 2 if surface_model != "rough" else 1.0)
        )
        results["edge"].append([float(value) for value in edge[_PIXEL_COUNT // 2 :]])
    return {"skin": subject.name, "boundary": surface_model, "d_mm": [float(x) for x in d], **results}


def measure_mitsuba(
    *, samples: int = 32000, output: Path = RESULTS_FILE, variant: str = "scalar_rgb"
) -> None:
    """Measure light across the edge of a half-lit plane, for all skins and surface models.

    Parameters
    ----------
    samples:
        Paths per pixel.
    output:
        JSON file of the results.
    variant:
        Variant of Mitsuba.
    """
    mi = load_mitsuba()
    edge = []
    with mitsuba_variant(mi, variant):
        for name, surface_models in COMPARED_SKINS.items():
            subject = load_subject(name)
            edge += [measure_skin(mi, subject, surface_model, samples) for surface_model in surface_models]
    half = _PIXEL_COUNT // 2
    centres = [(k + 0.5) * _VIEW_HALF_WIDTH_PER_BURLEY_WIDTH / half for k in range(half)]
    settings = {"mitsuba": mi.__version__, "samples": samples, "pixels": _PIXEL_COUNT, "at_d": centres}
    write_results(output, {**settings, "edges": edge}, 4)
