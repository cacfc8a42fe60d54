"""`dermis cite`: the works behind a picture."""

from __future__ import annotations

from dermis.cli.console import print_lines


def cite(*keys: str, profile: str | None = None) -> int:
    """Print BibTeX entries: of the given keys, or of the technique and a profile.

    For example:

        dermis cite

        dermis cite --profile dj3

        dermis cite Kelemen2001 DonnerJensen2005

    Parameters
    ----------
    keys:
        Author-year keys as they stand in the documentation.
    profile:
        A diffusion profile whose sources are wanted too, as render takes it [gpu-gems-3].
    """
    from dermis.cite import bibtex

    wanted = keys or (*TECHNIQUE, *_sources(profile or "gpu-gems-3"))
    print_lines(bibtex(wanted))
    return 0


def _sources(profile: str) -> tuple[str, ...]:
    from dermis.optics.profiles import find_table
    from dermis.optics.tissue import load_tissue

    if find_table(profile) is not None:  # its numbers are its own, but for the published ones
        return ("dEonLuebke2007", "DonnerJensen2005") if profile == "gpu-gems-3" else ()
    return load_tissue(profile).profile().sources


TECHNIQUE = ("dEonLuebke2007", "Dudash2007", "Kelemen2001", "Schlick1994", "Beckmann1963", "OlanoBaker2010")
