"""`dermis cite`: the works behind a picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from dermis.cli.console import print_lines
from dermis.specular.models import SpecularName

_SKIN, _SETTINGS = ("profile", "specular"), ("technique", "seams", "transmission")


def cite(
    *keys: str,
    scene: Path | None = None,
    technique: Literal["texture-space", "none", "one-blur", "gpu-gems-3", "screen-space", "pre-integrated"]
    | None = None,
    seams: Literal["stitch", "none", "clear-colour", "stretch-map", "alpha", "multi-uv"] | None = None,
    transmission: Literal["thin", "none"] | None = None,
    profile: str | None = None,
    specular: SpecularName | None = None,
    against: Literal["surface-integral", "heat", "path-traced", "cycles"] | None = None,
) -> int:
    """Print BibTeX entries: of the given keys, or of the works behind a picture or a comparison.

    For example:

        dermis cite

        dermis cite --scene scene.toml

        dermis cite --technique screen-space --profile dj3 --specular two-lobe

        dermis cite --against heat

        dermis cite Kelemen2001 DonnerJensen2005

    Parameters
    ----------
    keys:
        Author-year keys as they stand in the documentation.
    scene:
        A scene file: what its skin, lights and settings use; without it a picture with all defaults.
    technique:
        How light scatters below the surface, as render takes it [texture-space].
    seams:
        What is done at the map's seams, as render takes it [stitch].
    transmission:
        Whether light comes through thin parts, as render takes it [thin].
    profile:
        The diffusion profile, as render takes it [gpu-gems-3].
    specular:
        The model of the surface reflection, as render takes it [kelemen].
    against:
        A truth of compare, instead of a picture: it, the measure of difference and the techniques.
    """
    from dermis.cite import bibtex

    given = {name: value for name, value in locals().items() if value is not None}
    print_lines(bibtex(_wanted(given)))
    return 0


def _wanted(given: Mapping[str, Any]) -> tuple[str, ...]:
    """Keys of the works that the options ask for."""
    options = {name: value for name, value in given.items() if name not in ("keys", "bibtex")}
    if given["keys"]:
        _refuse_beside("keys", options)
        return tuple(given["keys"])
    if "against" in options:
        _refuse_beside("--against", {k: v for k, v in options.items() if k not in ("against", "technique")})
        return _of_comparison(options["against"], options.get("technique"))
    return _of_picture(options)


def _of_comparison(against: str, technique: str | None) -> tuple[str, ...]:
    from dermis.cli.compare_techniques import TECHNIQUES
    from dermis.comparison.sources import comparison_sources

    return comparison_sources(against, [technique] if technique else TECHNIQUES.split(","))


def _of_picture(options: Mapping[str, Any]) -> tuple[str, ...]:
    from dermis.scene import Settings, Skin, load_scene
    from dermis.scene.lights import studio
    from dermis.scene.sources import sources_of

    skin, settings = ({k: options[k] for k in names if k in options} for names in (_SKIN, _SETTINGS))
    if "scene" not in options:
        return sources_of(Skin(**skin), Settings(**settings), studio())
    scene, written = load_scene(options["scene"])
    maps = scene.head.maps
    return sources_of(
        Skin(**(scene.skin.model_dump() | skin)),
        Settings(**(written.model_dump() | settings)),
        scene.lights,
        scene.environment,
        relief=maps.normal is not None or maps.height is not None,
    )


def _refuse_beside(what: str, options: Mapping[str, Any]) -> None:
    from dermis.errors import refuse

    for name in options:
        refuse(f"--{name}", f"no such option beside {what}", "it came", "Leave one out")
