"""`dermis compare`: techniques against the truth, and the models of the surface against each other."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from dermis.cli.options import Json, parse_size

_TECHNIQUES = "none,one-blur,published,texture-space,screen-space,pre-integrated"


def compare(
    what: str,
    /,
    *,
    against: str = "surface-integral",
    techniques: str = _TECHNIQUES,
    light: str = "front",
    region: str | None = None,
    medium: str = "skin1",
    size: str = "256x256",
    atlas: int = 1024,
    samples: int = 64,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    roughness: float = 0.3,
    adapter: str = "auto",
    as_json: Json = False,
) -> int:
    """Compare techniques of scattering with the truth on a head, or the models of the surface.

    Techniques are judged with the profile's own colour, without surface reflection and energy term.

    Examples:

        dermis compare lee_perry_smith -o report.html

        dermis compare bust --against path-traced --light back --samples 256 --json

        dermis compare bust --against heat --region ear --techniques published,texture-space

        dermis compare specular -o plots

    Parameters
    ----------
    what:
        A head (sample, file), or specular: the models of the surface reflection.
    against:
        surface-integral (the profile summed over the surface: shows the map's error), heat (spread along the
        surface near the middle of the picture), path-traced (light through the medium; needs Mitsuba) or
        cycles (Blender's random walk; DERMIS_BLENDER_PYTHON names a Python that has bpy).
    techniques:
        Names with commas: none, one-blur, published, texture-space, screen-space, pre-integrated.
    light:
        front, back (through the ear) or laser (a stripe over cheek and ear).
    region:
        portrait, three-quarter, ear or cheek [where the light shows most].
    medium:
        skin1, skin2 or another medium with a name, index-matched.
    size:
        WIDTHxHEIGHT in pixels.
    atlas:
        Side of the irradiance map in texels.
    samples:
        Paths through each pixel, for path-traced.
    output:
        HTML report; for specular a folder of plots.
    roughness:
        Beckmann roughness m for specular [0.3].
    adapter:
        auto (the best), cpu (software), or a part of an adapter's name.
    as_json:
        Print one JSON object.
    """
    if what == "specular":
        from dermis.cli.compare_specular import compare_specular

        compare_specular(output, roughness, adapter, as_json)
        return 0
    from dermis.cli.compare_techniques import compare_techniques
    from dermis.cli.options import check
    from dermis.comparison.scenes import usual_region
    from dermis.scene import Settings

    sizes: dict[str, Any] = {"size": parse_size(size), "atlas": atlas}
    names = [name.strip() for name in techniques.split(",")]
    for name in names:
        check(Settings, sizes | {"technique": name}, {"technique": "techniques"})
    chosen = {
        "against": against,
        "techniques": names,
        "light": light,
        "region": region or usual_region(light),
        "medium": medium,
        "settings": Settings(**sizes),
        "samples": samples,
        "adapter": adapter,
    }
    compare_techniques(what, chosen, output, as_json)
    return 0
