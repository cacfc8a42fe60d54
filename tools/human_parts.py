"""Make src/dermis/human/regions/parts.csv: quads of lips, ears and mouth from the published masks.

FOLDER contains the published masks (CC0).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from dermis.base.command_line import run_script

HUMAN = Path(__file__).parent.parent / "src" / "dermis" / "human"
OUT = HUMAN / "regions" / "parts.csv"
MASKS = {"lips": "mpfb_lips", "ears": "mpfb_ears", "mouth": "mpfb_inside-mouth"}
HEADER = """\
# quantity: quads of the parametric human's skin whose middles lie in the published masks of lips, ears and
#   the inside of the mouth, as runs of numbers
# source: tools/human_parts.py from the masks of MakeHuman's hm08
# licence: CC0
part,first,last
"""


def main(folder: Path) -> None:
    """Find the quads and write the table."""
    rows = [f"{part},{a},{b}\n" for part, quads in parts(folder).items() for a, b in runs(quads)]
    OUT.write_text(HEADER + "".join(rows), encoding="utf-8")
    sys.stdout.write(f"{OUT}  {len(rows)} runs\n")


def parts(folder: Path) -> dict[str, NDArray[np.int64]]:
    """Return the indices of the quads of each part."""
    with np.load(HUMAN / "data" / "human.npz") as found:
        data: dict[str, NDArray[Any]] = {name: found[name] for name in found}
    u, v = data["uv1"][data["quads_uv1"].astype(int)].mean(axis=1).T
    skin = data["group"][: len(u)] == list(data["group_names"]).index("body")
    quads = {}
    for part, name in MASKS.items():
        mask = np.asarray(Image.open(folder / f"{name}.jpg").convert("L"))
        height, width = mask.shape
        within = mask[((1.0 - v) * height).astype(int), (u * width).astype(int)] > 127
        quads[part] = np.flatnonzero(within & skin)
    return quads


def runs(numbers: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Return the first and last of each run of consecutive numbers."""
    parted = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    return [(int(run[0]), int(run[-1])) for run in parted]


if __name__ == "__main__":
    run_script(main)
