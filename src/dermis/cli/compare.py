"""`dermis compare`: techniques against the truth, and the models of the surface against each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dermis.apps.validation.comparisons.scenes import ModelName
from dermis.base.arrays import Doubles
from dermis.base.atomic_write import refuse_output, replacing
from dermis.base.console import print_report, working_on
from dermis.base.errors import refuse
from dermis.base.extras import needed
from dermis.cli.head_options import ShapeOptions, check_head, note_eyes
from dermis.cli.options import (
    NO_OPTIONS,
    Adapter,
    Json,
    Options,
    Output,
    Integer,
    check,
    given,
    option_name,
    model_options,
)
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES
from dermis.specular.albedo import directional_albedo
from dermis.specular.cosines import cosines
from dermis.specular.models import MODELS

_PATH_TRACERS = ("path-traced", "cycles")
_SIZES = {"size": (256, 256), "atlas": 1024}
_DIRECTION = {"direction": "that of the truth's skin"}

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dermis.apps.validation.comparisons.compare import Comparison

    SizeOptions = Options
    SkinOptions = Options
else:
    SizeOptions = model_options(Settings, only=_SIZES, defaults=_SIZES)
    SkinOptions = model_options(Skin, only=("direction", "roughness"), defaults=_DIRECTION)


def compare(
    what: str,
    /,
    *,
    against: str | None = None,
    techniques: str | None = None,
    light: str | None = None,
    region: str | None = None,
    medium: str | None = None,
    model: ModelName | None = None,
    sizes: SizeOptions = NO_OPTIONS,
    skin: SkinOptions = NO_OPTIONS,
    shape: ShapeOptions = NO_OPTIONS,
    samples: Integer = None,
    output: Output = None,
    adapter: Adapter = "auto",
    as_json: Json = False,
) -> int:
    """Compare techniques of scattering with the truth on a head, or the models of the surface.

    Techniques are judged with the profile's own colour, without maps, surface reflection and energy term.

    Examples:

        dermis compare lee_perry_smith -o report.html

        dermis compare head.obj --unit-mm 100 --against heat

        dermis compare human --against path-traced --light back --samples 256 --json

        dermis compare human --against path-traced --light laser --model layered

        dermis compare human --against heat --region ear --techniques gpu-gems-3,texture-space

        dermis compare specular -o plots

    Parameters
    ----------
    what:
        A head (sample, file), or specular: the models of the surface reflection.
    against:
        surface-integral (the profile summed over the surface: shows the map's error), heat (spread along the
        surface near the middle of the picture), path-traced (light through the medium; needs Mitsuba) or
        cycles (Blender's random walk; DERMIS_BLENDER_PYTHON names a Python that has bpy) [surface-integral].
    techniques:
        Names with commas, as `dermis render --technique` takes them [all].
    light:
        front, back (through the ear) or laser (a stripe over cheek and ear) [front].
    region:
        portrait, three-quarter, ear, cheek or nose [where the light shows most].
    medium:
        skin1, skin2 or another medium with a name, index-matched [skin1].
    model:
        The medium's profile, as techniques have it: by tables of photons (counted), by layered diffusion, or
        by photons one by one (montecarlo) [counted for one semi-infinite layer, else layered].
    samples:
        Paths through each pixel, for path-traced and cycles [64].
    output:
        HTML report; for specular a folder of plots.
    """
    words = given(against=against, techniques=techniques, light=light, region=region)
    chosen = words | given(medium=medium, model=model, samples=samples) | sizes | skin | shape
    _refuse_unused_options(what, chosen)
    if what == "specular":
        check(Skin, skin)
        compare_specular(output, Skin(**skin).roughness, adapter, as_json)
    else:
        _compare_techniques(what, shape, _comparison_arguments(chosen, sizes) | {"adapter": adapter}, output, as_json)
    return 0


def _refuse_unused_options(what: str, chosen: Options) -> None:
    """Refuse options that would change nothing."""
    if what == "specular":
        idle = dict.fromkeys(chosen.keys() - {"roughness"}, "surface models are compared without a head")
    else:
        idle = {"roughness": "techniques are compared without surface reflection"}
        if chosen.get("against") not in _PATH_TRACERS:
            idle["samples"] = f"only {' and '.join(_PATH_TRACERS)} trace paths"
            idle["direction"] = f"only {' and '.join(_PATH_TRACERS)} know directions"
    for name, why in idle.items():
        if name in chosen:
            refuse(option_name(name), "no such option here", f"it came, and {why}", "Leave it out")


def _comparison_arguments(chosen: Options, sizes: Options) -> Options:
    """Return the arguments for `dermis.apps.validation.comparisons.compare`."""
    from dermis.apps.validation.comparisons.scenes import usual_region

    names = [name.strip() for name in chosen.get("techniques", ",".join(TECHNIQUES)).split(",")]
    for name in names:
        check(Settings, {**_SIZES, **sizes, "technique": name}, {"technique": "techniques"})
    light = chosen.get("light", "front")
    return {
        "against": chosen.get("against", "surface-integral"),
        "techniques": names,
        "light": light,
        "region": chosen.get("region", usual_region(light)),
        "medium": chosen.get("medium", "skin1"),
        "direction": chosen.get("direction"),
        "model": chosen.get("model"),
        "settings": Settings(**{**_SIZES, **sizes}),
        "samples": chosen.get("samples", 64),
    }


def _compare_techniques(
    head: str, shape: Options, chosen: Options, output: Path | None, as_json: bool
) -> None:
    """Render a head with each technique, compare it with a truth, print and write the result."""
    from dermis.apps.validation.comparisons import compare as comparison
    from dermis.apps.validation.comparisons.report import write_report
    from dermis.base.atomic_write import check_output
    from dermis.scene.heads import load_head

    check_head(head, shape)
    comparison.check_choices(*(chosen[option] for option in ("against", "light", "region", "medium")))
    if output is not None:
        check_output(output, (".html",), "Choose such a name")
    with working_on("comparing"):
        loaded = load_head(head, subdivide=0, **shape)
        note_eyes(loaded, shape.get("eyes"))
        made = comparison.compare(loaded, **chosen)
    if output is not None:
        write_report(output, made)
    report = {
        "title": made.title,
        "adapter": made.adapter,
        "truth": {"seconds": made.truth.seconds, "notes": list(made.truth.notes)},
        "rows": [asdict(row) for row in made.rows],
    }
    print_report(as_json, report, lambda: _lines(made))


def _lines(made: Comparison) -> Sequence[str]:
    from dermis.apps.validation.comparisons.report import cells

    lines = [
        f"{made.title}; times on {made.adapter}",
        f"against {made.against}, {made.truth.seconds:.0f} s: {'; '.join(made.truth.notes)}",
        "",
        f"{'technique':18}{'relative RMSE':>20}{'FLIP':>8}{'energy ratio':>20}{'ms':>9}",
    ]
    for row in made.rows:
        name, error, flip, energy, ms = cells(row)
        lines.append(f"{name:18}{error:>20}{flip:>8}{energy:>20}{ms:>9}")
    return lines


_DEGREES = (0, 30, 60, 75, 85)
_INCIDENT = {15: "#2a62b0", 45: "#2e8b57", 75: "#c0392b"}
_DUPLICATE_MODEL = "kelemen-direct"  # as kelemen
_COLUMNS = 4
_FARTHEST = 1.8  # root of the intensity over kelemen's peak; on rough skin some models pass it
_UP = np.array([0.0, 0.0, 1.0])


def compare_specular(output: Path | None, roughness: float, adapter: str, as_json: bool) -> None:
    """Print what surface models reflect and cost, and draw their lobes into a folder if there is one."""
    if output is not None:
        _draw_lobes_and_albedo(output, roughness)
    with working_on("measuring"):
        report = _specular_report(adapter)
    print_report(as_json, report, lambda: _specular_lines(report, roughness))


def _specular_report(adapter: str) -> Options:
    """Return all findings as one object for JSON."""
    from dermis.apps.validation.benchmarks.lobe_cost import lobe_cost_ns
    from dermis.gpu.failures import run_on_device
    from dermis.specular.comparison import albedo_rows, reciprocity_error
    from dermis.specular.fresnel import FRESNEL, hemispherical_reflectance

    name, cost = run_on_device(adapter, lambda device: (device.adapter.name, lobe_cost_ns(device)))
    return {
        "adapter": name,
        "hemispherical_fresnel": {name: hemispherical_reflectance(curve) for name, curve in FRESNEL.items()},
        "models": {
            name: {
                "note": model.note,
                "reciprocal": model.reciprocal,
                "albedo": albedo_rows(name),
                "reciprocity_error": reciprocity_error(name),
                "gpu_ns": cost[name, "schlick"],
                "gpu_ns_exact_fresnel": cost[name, "exact"],
            }
            for name, model in MODELS.items()
        },
    }


def _specular_lines(report: Options, m: float) -> list[str]:
    from dermis.specular.comparison import peak

    cosine = np.cos(np.radians(_DEGREES))
    angles = "".join(f"{f'{angle}°':>8}" for angle in _DEGREES)
    lines = [
        f"roughness {m:g}, rho_s 1, Schlick's Fresnel; cost of an evaluation on {report['adapter']}",
        "",
        f"{'model':24}{'peak':>8}{angles}{'reciprocity':>13}{'cost':>10}{'exact':>10}",
        f"{'':24}{'1/sr':>8}{'share reflected in all directions':>40}{'error':>13}{'ns':>10}{'ns':>10}",
    ]
    for name, found in report["models"].items():
        rho = "".join(f"{value:8.4f}" for value in directional_albedo(cosine, m, MODELS[name].lobe))
        costs = "".join(f"{found[key]:10.3g}" for key in ("gpu_ns", "gpu_ns_exact_fresnel"))
        lines.append(f"{name:24}{peak(name, m):8.4f}{rho}{found['reciprocity_error']:13.0e}{costs}")
    one_way = [(name, found["note"]) for name, found in report["models"].items() if not found["reciprocal"]]
    smooth = report["hemispherical_fresnel"]
    return [
        *lines,
        "",
        *(f"{name}: {note}." for name, note in one_way),
        f"A smooth surface of index 1.4 reflects {smooth['exact']:.1%} of light from everywhere "
        f"({smooth['schlick']:.1%} by Schlick's curve); the talk says up to 6 %.",
    ]


def _draw_lobes_and_albedo(folder: Path, m: float) -> None:
    """Write lobes.png and albedo.png of all models into a folder, made when it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        refuse_output(folder, fault)
    _save_figure(_lobe_figure(m), folder / "lobes.png")
    _save_figure(_albedo_figure(m), folder / "albedo.png")


def _distinct_models() -> list[str]:
    """Return names of the models that have a curve of their own."""
    return [name for name in MODELS if name != _DUPLICATE_MODEL]


def _lobe_figure(m: float) -> Figure:
    """Return the intensity under three lights in the plane of incidence: a polar panel for each model."""
    whole = _intensity("kelemen", m).max(axis=1, keepdims=True)
    roots = {name: np.sqrt(_intensity(name, m) / whole) for name in _distinct_models()}
    farthest = max(_FARTHEST, 1.05 * float(np.max(list(roots.values()))))
    rows = -(-len(roots) // _COLUMNS)
    figure = _figure(3.0 * _COLUMNS, 2.4 * rows)
    figure.suptitle(f"Intensity over kelemen's peak under the same light, on a root scale; m = {m:g}")
    panels = figure.subplots(rows, _COLUMNS, subplot_kw={"projection": "polar"}).ravel()
    for axes in panels[len(roots) :]:
        axes.remove()
    for axes, (name, curves) in zip(panels, roots.items(), strict=False):
        for (degrees, ink), curve in zip(_INCIDENT.items(), curves, strict=True):
            axes.plot(_view_angles(), curve, color=ink, label=f"light from {degrees}°")
        axes.set(thetamin=-90, thetamax=90, theta_zero_location="N", theta_direction=-1, rmax=farthest)
        axes.set(
            rticks=np.sqrt([0.25, 1.0, 2.25]),
            yticklabels=["", "1", ""],
            xticks=np.radians(range(-90, 91, 30)),
        )
        axes.tick_params(labelsize=7)
        axes.set_title(name, fontsize=10)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return figure


def _intensity(name: str, m: float) -> Doubles:
    """Return the BRDF times both cosines, (3, n), for each incident angle and view [1/sr]."""
    angle = _view_angles()
    view = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1)
    rows = []
    for degrees in _INCIDENT:
        theta = np.radians(degrees)
        light = np.broadcast_to([-np.sin(theta), 0.0, np.cos(theta)], view.shape)
        rows.append(MODELS[name].lobe(cosines(_UP, light, view), m) * np.cos(theta) * np.cos(angle))
    return np.stack(rows)


def _view_angles() -> Doubles:
    return np.radians(np.linspace(-89.9, 89.9, 1200))


def _albedo_figure(m: float) -> Figure:
    """Return the directional albedo by angle, all models in one panel."""
    figure = _figure(7.2, 4.6)
    axes = figure.subplots()
    degrees = np.linspace(0.0, 89.0, 180)
    for name in _distinct_models():
        rho = directional_albedo(np.cos(np.radians(degrees)), m, MODELS[name].lobe)
        axes.plot(degrees, rho, linewidth=1.4, label=name)
    axes.set(xlabel="angle from the normal [°]", ylabel="share reflected, ρ_s = 1", xlim=(0, 90))
    axes.set(yscale="log", title=f"Directional albedo, m = {m:g}")
    axes.grid(which="major", alpha=0.25, linewidth=0.6)
    axes.legend(frameon=False, fontsize=8)
    return figure


def _figure(width: float, height: float) -> Figure:
    """Return an empty figure of some size [inch]."""
    make: type[Figure] = needed("matplotlib.figure", "plots").Figure
    return make(figsize=(width, height), dpi=130, layout="constrained")


def _save_figure(figure: Figure, path: Path) -> None:
    with replacing(path) as trial:
        figure.savefig(trial)
