"""The command `dermis cite`: references of the methods used in a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from dermis.base.console import print_lines
from dermis.cli.options import NO_OPTIONS, Options, model_options, refuse_options
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

if TYPE_CHECKING:
    SettingsOptions = Options
    SkinOptions = Options
else:
    SettingsOptions = model_options(
        Settings, only_fields=("technique", "seams", "transmission", "tone", "bloom")
    )
    SkinOptions = model_options(Skin, only_fields=("profile", "specular", "fresnel", "energy", "direction"))


def cite(
    *keys: str,
    scene: Path | None = None,
    settings: SettingsOptions = NO_OPTIONS,
    skin: SkinOptions = NO_OPTIONS,
    against: Literal["surface-integral", "heat", "path-traced", "cycles"] | None = None,
) -> int:
    """Print the BibTeX entries of given keys, or of the works behind a picture or a comparison.

    Examples:

        dermis cite

        dermis cite --scene scene.toml

        dermis cite --technique screen-space --profile dj3 --specular two-lobe

        dermis cite --against heat

        dermis cite Kelemen2001 DonnerJensen2005

    Parameters
    ----------
    keys:
        Keys of works, such as Kelemen2001, as used in the documentation.
    scene:
        Scene file whose skin, lights and settings are cited. [default: the default picture]
    against:
        Reference solution of `dermis compare`: cite the works behind a comparison with this solution.
    """
    from dermis.base.citations import bibtex

    options = {**({"scene": scene} if scene else {}), **settings, **skin}
    if keys:
        refuse_options([*options, *(["against"] if against else [])], None, "with keys", "Remove one of them")
        selected: tuple[str, ...] = keys
    elif against:
        refuse_options(options.keys() - {"technique"}, None, "with --against", "Remove one of them")
        selected = _comparison_sources(against, settings.get("technique"))
    else:
        selected = _picture_sources(scene, settings, skin)
    print_lines(bibtex(selected))
    return 0


def _comparison_sources(reference_solution: str, technique: str | None) -> tuple[str, ...]:
    from dermis.apps.validation.comparisons.compare import comparison_sources
    from dermis.scene.techniques import TECHNIQUES

    return comparison_sources(reference_solution, [technique] if technique else TECHNIQUES)


def _picture_sources(scene_file: Path | None, settings: Options, skin: Options) -> tuple[str, ...]:
    from dermis.cli.scene_options import DEFAULT_RIG
    from dermis.scene import load_scene
    from dermis.scene.lights import preset_lights
    from dermis.scene.sources import picture_citation_keys

    if scene_file is None:
        return picture_citation_keys(Skin(**skin), Settings(**settings), preset_lights(DEFAULT_RIG))
    scene, scene_settings = load_scene(scene_file)
    maps = scene.head.maps
    return picture_citation_keys(
        Skin(**(scene.skin.model_dump() | dict(skin))),
        Settings(**(scene_settings.model_dump() | dict(settings))),
        scene.lights,
        scene.environment,
        has_relief=maps.normal is not None or maps.height is not None,
    )
