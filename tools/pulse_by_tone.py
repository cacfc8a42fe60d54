"""Plot the relative change of skin colour by the pulse against melanin, as the model of skin predicts it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.base.command_line import run_script
from dermis.optics.pigments.parameters import DEFAULT_SKIN
from dermis.optics.skin_colours import colour_table
from dermis.scene.pulse import Pulse

MELANIN = np.geomspace(0.003, 0.4, 40)
MEASURED_DIRECTION = np.array([0.33, 0.77, 0.53])  # de Haan and van Leest 2014


def main(output: Path, /) -> None:
    """Plot the relative change of skin colour by the pulse against melanin, as the model of skin predicts it.

    Parameters
    ----------
    output:
        Picture to write (.png).
    """
    from matplotlib import pyplot as plt

    amplitude, table = Pulse().amplitude, colour_table(DEFAULT_SKIN, 129)
    blood = np.full_like(MELANIN, DEFAULT_SKIN.blood)
    low, high = (table.lookup(MELANIN, blood * (1 + sign * amplitude / 2)) for sign in (-1, 1))
    change = 100 * (low - high) / (0.5 * (low + high))
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), constrained_layout=True)
    direction = change / np.linalg.norm(change, axis=1, keepdims=True)
    for k, (name, colour) in enumerate({"red": "C3", "green": "C2", "blue": "C0"}.items()):
        left.semilogx(MELANIN, change[:, k], colour, label=name)
        right.semilogx(MELANIN, direction[:, k], colour)
        right.axhline(MEASURED_DIRECTION[k], color=colour, linestyle=":")
    left.set(
        xlabel="melanosomes in the epidermis [-]",
        ylabel="peak-to-peak pulse, relative to the mean colour [%]",
    )
    right.set(xlabel="melanosomes in the epidermis [-]", ylabel="direction (dotted: measured)")
    left.legend()
    figure.savefig(output, dpi=80)


if __name__ == "__main__":
    run_script(main)
