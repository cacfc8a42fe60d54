"""The command `dermis compare`: techniques against reference solutions, and specular models side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dermis.apps.validation.comparisons.scenes import ModelName
from dermis.base.arrays import Doubles
from dermis.base.atomic_write import atomic_file, refuse_output
from dermis.base.console import print_report, spinner
from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.cli.head_options import MeshOptions, check_head_options, note_kept_eyeballs
from dermis.cli.options import (
    NO_OPTIONS,
    AdapterOption,
    IntegerOption,
    JsonOption,
    OptionalOutputPath,
    Options,
    check_fields,
    drop_none,
    model_options,
    option_name,
)
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES
from dermis.specular.albedo import directional_albedo
from dermis.specular.cosines import cosines
from dermis.specular.models import MODELS

_PATH_TRACERS = ("path-traced", "cycles")
_DEFAULT_SIZE_SETTINGS = {"size": (256, 256), "atlas": 1024}
_DIRECTION_DEFAULT_HELP = {"direction": "that of the truth's skin"}

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dermis.apps.validation.comparisons.compare import Comparison

    SizeOptions = Options
    SkinOptions = Options
else:
    SizeOptions = model_options(
        Settings, only_fields=_DEFAULT_SIZE_SETTINGS, shown_defaults=_DEFAULT_SIZE_SETTINGS
    )
    SkinOptions = model_options(
        Skin, only_fields=("direction", "roughness"), shown_defaults=_DIRECTION_DEFAULT_HELP
    )


def compare(
    subject: str,
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
    shape: MeshOptions = NO_OPTIONS,
    samples: IntegerOption = None,
    output: OptionalOutputPath = None,
    adapter: AdapterOption = "auto",
    as_json: JsonOption = False,
) -> int:
    """Compare scattering techniques with a reference solution, or the specular models with each other.

    When techniques are compared, the skin has the uniform colour of the diffusion profile, without maps or
    surface reflection.

    Examples:

        dermis compare lee_perry_smith -o report.html

        dermis compare head.obj --unit-mm 100 --against heat

        dermis compare human --against path-traced --light back --samples 256 --json

        dermis compare human --against path-traced --light laser --model layered

        dermis compare human --against heat --region ear --techniques gpu-gems-3,texture-space

        dermis compare specular -o plots

    Parameters
    ----------
    subject:
        A head (sample name or file), or the word specular to compare models of surface reflection.
    against:
        Reference solution: surface-integral (profile integrated over the surface; shows the error due to the
        atlas), heat (diffusion along the surface around the centre of the picture), path-traced (light
        transport in the medium; needs Mitsuba) or cycles (Blender's random walk; the variable
        DERMIS_BLENDER_PYTHON names a Python interpreter with bpy). [default: surface-integral]
    techniques:
        Names of techniques, separated by commas; see `dermis render --technique`. [default: all]
    light:
        Light: front, back (through the ear) or laser (a stripe across cheek and ear). [default: front]
    region:
        Part of the head in the picture: portrait, three-quarter, ear, cheek or nose. [default: where the
        light has the largest effect]
    medium:
        skin1, skin2 or another named medium, with an index-matched surface. [default: skin1]
    model:
        Model of the diffusion profile: counted (stored tables of photon counts), layered (layered diffusion)
        or montecarlo (photons traced now). [default: counted for one semi-infinite layer, else layered]
    samples:
        Paths per pixel, for path-traced and cycles. [default: 64]
    output:
        HTML report to write; for specular, the folder of the plots.
    as_json:
        Print one JSON object with the measured values.
    """
    named = drop_none(against=against, techniques=techniques, light=light, region=region)
    options = named | drop_none(medium=medium, model=model, samples=samples) | sizes | skin | shape
    _refuse_unused_options(subject, options)
    if subject == "specular":
        compare_specular(output, check_fields(Skin, skin).roughness, adapter, as_json)
    else:
        arguments = _comparison_arguments(options, sizes) | {"adapter": adapter}
        _compare_techniques(subject, shape, arguments, output, as_json)
    return 0


def _refuse_unused_options(compared_subject: str, options: Options) -> None:
    """Raise DermisError for options that do not affect the comparison of a subject.

    compared_subject : name of a head, or "specular"
    """
    if compared_subject == "specular":
        unused = dict.fromkeys(options.keys() - {"roughness"}, "specular models are compared without a head")
    else:
        unused = {"roughness": "techniques are compared without surface reflection"}
        if options.get("against") not in _PATH_TRACERS:
            unused["samples"] = f"only {' and '.join(_PATH_TRACERS)} trace paths"
            unused["direction"] = f"only {' and '.join(_PATH_TRACERS)} depend on directions"
    for name, reason in unused.items():
        if name in options:
            refuse(option_name(name), "no such option here", f"it is given, and {reason}", "Remove it")


def _comparison_arguments(options: Options, size_options: Options) -> Options:
    """Return the keyword arguments of `dermis.apps.validation.comparisons.compare` that the options describe.

    options : options given on the command line, by name
    size_options : picture and atlas sizes given on the command line
    """
    from dermis.apps.validation.comparisons.scenes import default_region

    names = [name.strip() for name in options.get("techniques", ",".join(TECHNIQUES)).split(",")]
    size_settings = {**_DEFAULT_SIZE_SETTINGS, **size_options}
    for name in names:
        check_fields(Settings, {**size_settings, "technique": name}, {"technique": "techniques"})
    light = options.get("light", "front")
    return {
        "against": options.get("against", "surface-integral"),
        "techniques": names,
        "light": light,
        "region": options.get("region", default_region(light)),
        "medium": options.get("medium", "skin1"),
        "direction": options.get("direction"),
        "model": options.get("model"),
        "settings": Settings(**size_settings),
        "samples": options.get("samples", 64),
    }


def _compare_techniques(
    head: str, shape_options: Options, comparison_arguments: Options, output: Path | None, as_json: bool
) -> None:
    """Compare techniques with a reference solution on a head, print the errors and write an HTML report.

    shape_options : options of the head that affect its mesh
    comparison_arguments : keyword arguments of the comparison
    """
    from dermis.apps.validation.comparisons import compare as comparison
    from dermis.apps.validation.comparisons.report import write_report
    from dermis.base.atomic_write import check_output
    from dermis.scene.heads import load_head

    check_head_options(head, shape_options)
    comparison.check_names(
        *(comparison_arguments[option] for option in ("against", "light", "region", "medium"))
    )
    if output is not None:
        check_output(output, (".html",), "Choose such a name")
    with spinner("comparing"):
        loaded_head = load_head(head, subdivide=0, **shape_options)
        note_kept_eyeballs(loaded_head, shape_options.get("eyes"))
        result = comparison.compare(loaded_head, **comparison_arguments)
    if output is not None:
        write_report(output, result)
    report = {
        "title": result.title,
        "adapter": result.adapter,
        "truth": {"seconds": result.reference.seconds, "notes": list(result.reference.notes)},
        "rows": [asdict(row) for row in result.rows],
    }
    print_report(as_json, report, lambda: _report_lines(result))


def _report_lines(comparison: Comparison) -> Sequence[str]:
    from dermis.apps.validation.comparisons.report import error_cells

    truth = comparison.reference
    lines = [
        f"{comparison.title}; times on {comparison.adapter}",
        f"against {comparison.against}, {truth.seconds:.0f} s: {'; '.join(truth.notes)}",
        "",
        f"{'technique':18}{'relative RMSE':>20}{'FLIP':>8}{'energy ratio':>20}{'ms':>9}",
    ]
    for row in comparison.rows:
        name, error, flip, energy, ms = error_cells(row)
        lines.append(f"{name:18}{error:>20}{flip:>8}{energy:>20}{ms:>9}")
    return lines


_ALBEDO_INCIDENCE_DEGREES = (0, 30, 60, 75, 85)  # angles of the printed albedos
_COLOUR_OF_INCIDENCE_DEGREES = {
    15: "#2a62b0",
    45: "#2e8b57",
    75: "#c0392b",
}  # angles of incidence [degrees] and plot colours
_OMITTED_DUPLICATE_MODEL = "kelemen-direct"  # the same lobe as kelemen
_PLOT_COLUMN_COUNT = 4
# smallest radius of the plots: square root of the intensity relative to kelemen's peak
_MIN_PLOT_RADIUS = 1.8
_SURFACE_NORMAL = np.array([0.0, 0.0, 1.0])


def compare_specular(output: Path | None, roughness: float, adapter: str, as_json: bool) -> None:
    """Print directional albedo and GPU cost of the specular models, and plot their lobes.

    output : folder of the plots; None for no plots
    roughness : Beckmann roughness m [-]
    """
    if output is not None:
        _draw_lobes_and_albedo(output, roughness)
    with spinner("measuring"):
        report = _specular_report(adapter)
    print_report(as_json, report, lambda: _specular_lines(report, roughness))


def _specular_report(adapter: str) -> Options:
    """Return albedos, reciprocity errors and GPU costs of all specular models, for JSON."""
    from dermis.apps.validation.benchmarks.lobe_cost import lobe_cost_ns
    from dermis.gpu.failures import run_on_device
    from dermis.specular.comparison import directional_albedo_rows, reciprocity_error
    from dermis.specular.fresnel import FRESNEL, hemispherical_reflectance

    name, cost = run_on_device(adapter, lambda device: (device.adapter.name, lobe_cost_ns(device)))
    return {
        "adapter": name,
        "hemispherical_fresnel": {name: hemispherical_reflectance(curve) for name, curve in FRESNEL.items()},
        "models": {
            name: {
                "note": model.note,
                "reciprocal": model.reciprocal,
                "albedo": directional_albedo_rows(name),
                "reciprocity_error": reciprocity_error(name),
                "gpu_ns": cost[name, "schlick"],
                "gpu_ns_exact_fresnel": cost[name, "exact"],
            }
            for name, model in MODELS.items()
        },
    }


def _specular_lines(report: Options, roughness: float) -> list[str]:
    from dermis.specular.comparison import normal_incidence_peak

    cosine = np.cos(np.radians(_ALBEDO_INCIDENCE_DEGREES))
    angles = "".join(f"{f'{angle}°':>8}" for angle in _ALBEDO_INCIDENCE_DEGREES)
    lines = [
        f"roughness {roughness:g}, rho_s 1, Schlick's Fresnel term; "
        f"cost per evaluation on {report['adapter']}",
        "",
        f"{'model':24}{'peak':>8}{angles}{'reciprocity':>13}{'cost':>10}{'exact':>10}",
        f"{'':24}{'1/sr':>8}{'directional albedo':>40}{'error':>13}{'ns':>10}{'ns':>10}",
    ]
    for name, values in report["models"].items():
        albedos = "".join(
            f"{value:8.4f}" for value in directional_albedo(cosine, roughness, MODELS[name].lobe)
        )
        costs = "".join(f"{values[key]:10.3g}" for key in ("gpu_ns", "gpu_ns_exact_fresnel"))
        peak, error = normal_incidence_peak(name, roughness), values["reciprocity_error"]
        lines.append(f"{name:24}{peak:8.4f}{albedos}{error:13.0e}{costs}")
    notes = [(name, values["note"]) for name, values in report["models"].items() if not values["reciprocal"]]
    fresnel = report["hemispherical_fresnel"]
    return [
        *lines,
        "",
        *(f"{name}: {note}." for name, note in notes),
        f"A smooth surface of index 1.4 reflects {fresnel['exact']:.1%} of uniform illumination "
        f"({fresnel['schlick']:.1%} by Schlick's approximation); the 2007 talk states up to 6 %.",
    ]


def _draw_lobes_and_albedo(folder: Path, roughness: float) -> None:
    """Plot lobes and directional albedos of the specular models to lobes.png and albedo.png in a folder."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        refuse_output(folder, fault)
    _save_figure(_lobe_figure(roughness), folder / "lobes.png")
    _save_figure(_albedo_figure(roughness), folder / "albedo.png")


def _distinct_model_names() -> list[str]:
    """Return the names of the specular models, except "kelemen-direct", which has the lobe of "kelemen"."""
    return [name for name in MODELS if name != _OMITTED_DUPLICATE_MODEL]


def _lobe_figure(roughness: float) -> Figure:
    """Return polar plots of reflected intensity in the plane of incidence, one plot per specular model.

    roughness : Beckmann roughness [-]
    """
    peak = _lobe_intensity("kelemen", roughness).max(axis=1, keepdims=True)
    curves_by_model = {
        name: np.sqrt(_lobe_intensity(name, roughness) / peak) for name in _distinct_model_names()
    }
    radius = max(_MIN_PLOT_RADIUS, 1.05 * float(np.max(list(curves_by_model.values()))))
    rows = -(-len(curves_by_model) // _PLOT_COLUMN_COUNT)
    figure = _empty_figure(3.0 * _PLOT_COLUMN_COUNT, 2.4 * rows)
    figure.suptitle(f"Intensity relative to the peak of kelemen, square root scale; m = {roughness:g}")
    panels = figure.subplots(rows, _PLOT_COLUMN_COUNT, subplot_kw={"projection": "polar"}).ravel()
    for axes in panels[len(curves_by_model) :]:
        axes.remove()
    for axes, (name, curves) in zip(panels, curves_by_model.items(), strict=False):
        for (degrees, colour), curve in zip(_COLOUR_OF_INCIDENCE_DEGREES.items(), curves, strict=True):
            axes.plot(_view_angles(), curve, color=colour, label=f"light from {degrees}°")
        axes.set(thetamin=-90, thetamax=90, theta_zero_location="N", theta_direction=-1, rmax=radius)
        axes.set(rticks=np.sqrt([0.25, 1.0, 2.25]), yticklabels=["", "1", ""])
        axes.set(xticks=np.radians(range(-90, 91, 30)))
        axes.tick_params(labelsize=7)
        axes.set_title(name, fontsize=10)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return figure


def _lobe_intensity(model_name: str, roughness: float) -> Doubles:
    """Return the reflected intensity (3, n) of a specular model [1/sr].

    The intensity is f cos(theta_i) cos(theta_o), where f is the BRDF of the model.

    Each row belongs to an angle of incidence in `_COLOUR_OF_INCIDENCE_DEGREES`, each column to an angle in
    `_view_angles`.

    model_name : name of the specular model
    roughness : Beckmann roughness [-]
    """
    angle = _view_angles()
    view = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1)
    rows = []
    for degrees in _COLOUR_OF_INCIDENCE_DEGREES:
        theta = np.radians(degrees)
        light = np.broadcast_to([-np.sin(theta), 0.0, np.cos(theta)], view.shape)
        rows.append(
            MODELS[model_name].lobe(cosines(_SURFACE_NORMAL, light, view), roughness)
            * np.cos(theta)
            * np.cos(angle)
        )
    return np.stack(rows)


def _view_angles() -> Doubles:
    return np.radians(np.linspace(-89.9, 89.9, 1200))


def _albedo_figure(roughness: float) -> Figure:
    """Return a plot of each specular model's directional albedo against the angle of incidence.

    roughness : Beckmann roughness [-]
    """
    figure = _empty_figure(7.2, 4.6)
    axes = figure.subplots()
    degrees = np.linspace(0.0, 89.0, 180)
    for name in _distinct_model_names():
        rho = directional_albedo(np.cos(np.radians(degrees)), roughness, MODELS[name].lobe)
        axes.plot(degrees, rho, linewidth=1.4, label=name)
    axes.set(xlabel="angle from the normal [°]", ylabel="directional albedo, ρ_s = 1", xlim=(0, 90))
    axes.set(yscale="log", title=f"Directional albedo, m = {roughness:g}")
    axes.grid(which="major", alpha=0.25, linewidth=0.6)
    axes.legend(frameon=False, fontsize=8)
    return figure


def _empty_figure(width_inch: float, height_inch: float) -> Figure:
    """Return an empty matplotlib figure of a given width and height [inch]."""
    figure_class: type[Figure] = import_extra("matplotlib.figure", "plots").Figure
    return figure_class(figsize=(width_inch, height_inch), dpi=130, layout="constrained")


def _save_figure(figure: Figure, path: Path) -> None:
    with atomic_file(path) as temporary:
        figure.savefig(temporary)
