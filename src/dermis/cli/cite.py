"""`dermis cite`: the works behind a picture."""

from __future__ import annotations

from dermis.cli.console import print_lines


def cite(*keys: str) -> int:
    """Print BibTeX entries: of the given keys, or of the technique itself.

    For example:

        dermis cite

        dermis cite Kelemen2001 DonnerJensen2005

    Parameters
    ----------
    keys:
        Author-year keys as they stand in the documentation.
    """
    from dermis.cite import bibtex

    print_lines(bibtex(keys or TECHNIQUE))
    return 0


TECHNIQUE = ("dEonLuebke2007", "Dudash2007", "Kelemen2001", "Schlick1994", "Beckmann1963", "OlanoBaker2010")
