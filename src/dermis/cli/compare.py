"""`dermis compare`: techniques against the truth, and the models of the surface against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dermis.apps.validation.comparisons.scenes import ModelName
from dermis.base.console import print_json, print_lines, working_on
from dermis.base.errors import refuse
from dermis.cli.eye_options import note_eyes
from dermis.cli.head_options import ShapeOptions, check_head
from dermis.cli.options import NOTHING, Adapter, Json, Output, Whole, check, given, option_name, options_of
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES

_BY_PATHS = ("path-traced", "cycles")
_SIZES = {"size": (256, 256), "atlas": 1024}
_DIRECTION = {"direction": "that of the truth's skin"}

if TYPE_CHECKING:
    from dermis.apps.validation.comparisons.compare import Comparison

    SizeOptions = dict[str, Any]
    SkinOptions = dict[str, Any]
else:
    SizeOptions = options_of(Settings, only=_SIZES, defaults=_SIZES)
    SkinOptions = options_of(Skin, only=("direction", "roughness"), defaults=_DIRECTION)


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
    sizes: SizeOptions = NOTHING,
    skin: SkinOptions = NOTHING,
    shape: ShapeOptions = NOTHING,
    samples: Whole = None,
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
    _check_used(what, chosen)
    if what == "specular":
        from dermis.cli.compare_specular import compare_specular

        check(Skin, skin)
        compare_specular(output, Skin(**skin).roughness, adapter, as_json)
    else:
        _compare_techniques(what, shape, _choose(chosen, sizes) | {"adapter": adapter}, output, as_json)
    return 0


def _check_used(what: str, chosen: Mapping[str, Any]) -> None:
    """Refuse options that would change nothing."""
    if what == "specular":
        idle = dict.fromkeys(chosen.keys() - {"roughness"}, "surface models are compared without a head")
    else:
        idle = {"roughness": "techniques are compared without surface reflection"}
        if chosen.get("against") not in _BY_PATHS:
            idle["samples"] = f"only {' and '.join(_BY_PATHS)} trace paths"
            idle["direction"] = f"only {' and '.join(_BY_PATHS)} know directions"
    for name, why in idle.items():
        if name in chosen:
            refuse(option_name(name), "no such option here", f"it came, and {why}", "Leave it out")


def _choose(chosen: Mapping[str, Any], sizes: Mapping[str, Any]) -> dict[str, Any]:
    """What `dermis.apps.validation.comparisons.compare` is asked for."""
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
    head: str, shape: Mapping[str, Any], chosen: dict[str, Any], output: Path | None, as_json: bool
) -> None:
    """Render a head with each technique, judge it by a truth, print and write what came of it."""
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
    if as_json:
        print_json(_report(made))
    else:
        print_lines(*_lines(made))


def _report(made: Comparison) -> dict[str, Any]:
    return {
        "title": made.title,
        "adapter": made.adapter,
        "truth": {"seconds": made.truth.seconds, "notes": list(made.truth.notes)},
        "rows": [asdict(row) for row in made.rows],
    }


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
