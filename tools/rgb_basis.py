"""Compute the spectra of red, green and blue, from which `dermis.optics.bands` upsamples RGB colours.

The method is that of [MallettYuksel2019]: the smoothest reflectances that sum to 1 at each wavelength and
have, under D65, the colours of the primaries of Rec. 709.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, minimize

from dermis.base.command_line import run_script
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights

_TABLE = Path(__file__).parents[1] / "src/dermis/optics/data/spectra/rgb-basis.csv"
_HEADING = """\
# quantity: reflectances with the colours of the primaries of Rec. 709 under D65; they sum to 1
# unit: wavelength in nm, reflectance dimensionless
# source: computed by tools/rgb_basis.py, by the method of [MallettYuksel2019]
# licence: CC0-1.0
wavelength_nm,red,green,blue
"""


def smooth_basis() -> NDArray[np.float64]:
    """Return the reflectances (31, 3) of red, green and blue at `WAVELENGTHS_NM` [-]."""
    n = len(WAVELENGTHS_NM)
    slope = np.kron(np.diff(np.eye(n), axis=0), np.eye(3))
    colours = np.kron(rgb_weights(WAVELENGTHS_NM), np.eye(3))
    sums = np.kron(np.eye(n), np.ones(3))
    matrix, target = np.vstack([sums, colours]), np.concatenate([np.ones(n), np.eye(3).ravel()])
    vectors, scales, rows = np.linalg.svd(matrix, full_matrices=False)
    kept = scales > 1e-9 * scales[0]  # some equations follow from others
    target = (vectors[:, kept].T @ target) / scales[kept]
    energy = slope.T @ slope
    solution = minimize(
        lambda x: float(x @ energy @ x),
        np.full(3 * n, 1.0 / 3.0, np.float64),
        jac=lambda x: np.asarray(2.0 * energy @ x, np.float64),
        bounds=Bounds(0.0, 1.0),
        constraints=LinearConstraint(rows[kept], target, target),
        method="SLSQP",
        options={"maxiter": 1000, "ftol": 1e-12},  # type: ignore[call-overload]
    )
    return np.asarray(solution.x.reshape(n, 3))


def main(output: Path = _TABLE) -> None:
    """Compute the spectra of red, green and blue.

    Parameters
    ----------
    output:
        Table to write.
    """
    rows = (
        f"{wavelength:.0f},{','.join(f'{value:.7f}' for value in values)}\n"
        for wavelength, values in zip(WAVELENGTHS_NM, np.clip(smooth_basis(), 0.0, 1.0), strict=True)
    )
    output.write_text(_HEADING + "".join(rows), "utf-8")


if __name__ == "__main__":
    run_script(main)
