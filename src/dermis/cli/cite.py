"""`dermis cite`: the works behind a picture."""

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
    SettingsOptions = model_options(Settings, only=("technique", "seams", "transmission", "tone", "bloom"))
    SkinOptions = model_options(Skin, only=("profile", "specular", "fresnel", "energy", "direction"))


def cite(
    *keys: str,
    scene: Path | None = None,
    settings: SettingsOptions = NO_OPTIONS,
    skin: SkinOptions = NO_OPTIONS,
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
    against:
        A truth of compare, instead of a picture: it, the measure of difference and the techniques.
    """
    from dermis.base.citations import bibtex

    options = {**({"scene": scene} if scene else {}), **settings, **skin}
    if keys:
        refuse_options([*options, *(["against"] if against else [])], None, "beside keys", "Leave one out")
        wanted: tuple[str, ...] = keys
    elif against:
        refuse_options(options.keys() - {"technique"}, None, "beside --against", "Leave one out")
        wanted = _comparison_sources(against, settings.get("technique"))
    else:
        wanted = _picture_sources(scene, settings, skin)
    print_lines(bibtex(wanted))
    return 0


def _comparison_sources(against: str, technique: str | None) -> tuple[str, ...]:
    from dermis.apps.validation.comparisons.compare import comparison_sources
    from dermis.scene.techniques import TECHNIQUES

    return comparison_sources(against, [technique] if technique else TECHNIQUES)


def _picture_sources(file: Path | None, settings: Options, skin: Options) -> tuple[str, ...]:
    from dermis.scene import load_scene
    from dermis.scene.lights import studio
    from dermis.scene.sources import sources_of

    if file is None:
        return sources_of(Skin(**skin), Settings(**settings), studio())
    scene, written = load_scene(file)
    maps = scene.head.maps
    return sources_of(
        Skin(**(scene.skin.model_dump() | dict(skin))),
        Settings(**(written.model_dump() | dict(settings))),
        scene.lights,
        scene.environment,
        relief=maps.normal is not None or maps.height is not None,
    )
