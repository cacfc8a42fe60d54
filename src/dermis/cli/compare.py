"""`dermis compare`: techniques against the truth, and the models of the surface against each other."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from dermis.cli.options import Json, Whole
from dermis.errors import refuse

_BY_PATHS = ("path-traced", "cycles")
_OF_HEADS = ("against", "techniques", "light", "region", "medium", "direction", "size", "atlas", "samples")


def compare(
    what: str,
    /,
    *,
    against: str | None = None,
    techniques: str | None = None,
    light: str | None = None,
    region: str | None = None,
    medium: str | None = None,
    direction: Literal["lambertian", "half-space"] | None = None,
    size: str | None = None,
    atlas: Whole = None,
    samples: Whole = None,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    roughness: float | None = None,
    adapter: str = "auto",
    as_json: Json = False,
) -> int:
    """Compare techniques of scattering with the truth on a head, or the models of the surface.

    Techniques are judged with the profile's own colour, without surface reflection and energy term.

    Examples:

        dermis compare lee_perry_smith -o report.html

        dermis compare bust --against path-traced --light back --samples 256 --json

        dermis compare bust --against heat --region ear --techniques gpu-gems-3,texture-space

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
        Names with commas: none, one-blur, gpu-gems-3, texture-space, screen-space, pre-integrated [all].
    light:
        front, back (through the ear) or laser (a stripe over cheek and ear) [front].
    region:
        portrait, three-quarter, ear, cheek or nose [where the light shows most].
    medium:
        skin1, skin2 or another medium with a name, index-matched [skin1].
    direction:
        How skin returns light: lambertian alike by all directions, or as a half-space [lambertian].
    size:
        WIDTHxHEIGHT in pixels [256x256].
    atlas:
        Side of the irradiance map in texels [1024].
    samples:
        Paths through each pixel, for path-traced and cycles [64].
    output:
        HTML report; for specular a folder of plots.
    roughness:
        Beckmann roughness m, for specular only [0.3].
    adapter:
        auto (the best), cpu (software), or a part of an adapter's name.
    as_json:
        Print one JSON object.
    """
    given = {name: value for name, value in locals().items() if value is not None}
    _check_used(what, given)
    if what == "specular":
        from dermis.cli.compare_specular import compare_specular

        compare_specular(output, given.get("roughness", 0.3), adapter, as_json)
        return 0
    from dermis.cli.compare_techniques import choose, compare_techniques

    compare_techniques(what, choose(given), output, as_json)
    return 0


def _check_used(what: str, given: Mapping[str, Any]) -> None:
    """Refuse options that would change nothing."""
    if what == "specular":
        idle = dict.fromkeys(_OF_HEADS, "surface models are compared without a head")
    else:
        idle = {"roughness": "techniques are compared without surface reflection"}
        if given.get("against") not in _BY_PATHS:
            idle["samples"] = f"only {' and '.join(_BY_PATHS)} trace paths"
            idle["direction"] = f"only {' and '.join(_BY_PATHS)} know directions"
    for name, why in idle.items():
        if name in given:
            refuse(f"--{name}", "no such option here", f"it came, and {why}", "Leave it out")
