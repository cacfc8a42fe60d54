"""Count the knots of hair that are inside the skin, for sampled people in every hair style.

`python benchmarks/hair_penetration.py --people 1000` prints a line for each style.
"""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from dermis.apps.validation.people.hair_penetration import hair_penetration, with_style
from dermis.base.command_line import run_script
from dermis.base.console import print_lines
from dermis.human.hair.look import HAIR_STYLES
from dermis.human.person import Human

LIMIT_MM = 0.5


def main(
    people: int = 20, first: int = 0, style: Annotated[list[str] | None, Parameter(negative="")] = None
) -> None:
    """Print the share of knots inside the skin for each hair style.

    Parameters
    ----------
    people:
        Number of people, with consecutive seeds.
    first:
        Seed of the first person.
    style:
        Styles to check. [default: all]
    """
    for name in style or HAIR_STYLES[1:]:
        found = [
            hair_penetration(with_style(Human.sampled(seed), name), LIMIT_MM)
            for seed in range(first, first + people)
        ]
        share = 100.0 * sum(one.inside for one in found) / max(1, sum(one.knots for one in found))
        deepest = max(one.deepest_mm for one in found)
        print_lines(f"{name:16} {share:7.3f} % of knots deeper than {LIMIT_MM} mm, deepest {deepest:.1f} mm")


if __name__ == "__main__":
    run_script(main)
