"""`dermis cite`: the works behind a picture."""

from __future__ import annotations

from dermis.cli.console import print_lines
from dermis.specular.names import ModelName


def cite(*keys: str, profile: str | None = None, specular: ModelName | None = None) -> int:
    """Print BibTeX entries: of the given keys, or of the technique, a surface model and a profile.

    For example:

        dermis cite

        dermis cite --profile dj3 --specular two-lobe

        dermis cite Kelemen2001 DonnerJensen2005

    Parameters
    ----------
    keys:
        Author-year keys as they stand in the documentation.
    profile:
        A diffusion profile whose sources are wanted too, as render takes it [gpu-gems-3].
    specular:
        A surface model whose sources are wanted too [kelemen].
    """
    from dermis.cite import bibtex
    from dermis.specular.models import MODELS

    surface = MODELS[specular or "kelemen"].sources
    wanted = keys or (*TECHNIQUE, *surface, *_sources(profile or "gpu-gems-3"))
    print_lines(bibtex(wanted))
    return 0


def _sources(profile: str) -> tuple[str, ...]:
    from dermis.optics.profiles import find_table
    from dermis.optics.tissue import load_tissue

    if find_table(profile) is not None:  # its numbers are its own, but for the published ones
        return ("dEonLuebke2007", "DonnerJensen2005") if profile == "gpu-gems-3" else ()
    return load_tissue(profile).profile().sources


TECHNIQUE = ("dEonLuebke2007", "Dudash2007", "Schlick1994", "OlanoBaker2010")
