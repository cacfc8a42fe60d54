"""Make src/dermis/environment/data/mirrors.csv: specular lobes as sums of isotropic lobes.

Takes two or three minutes. The method is described in `dermis.environment.isotropic_fits`.
"""

from __future__ import annotations

from pathlib import Path

from dermis.base.atomic_write import atomic_file
from dermis.base.command_line import run_script
from dermis.environment.isotropic_fits import (
    LOBE_COUNT,
    LOBE_TABLE_COSINES,
    LOBE_TABLE_ROUGHNESSES,
    fit_isotropic_lobes,
)
from dermis.specular.models import MODELS

OUT = Path(__file__).parent.parent / "src" / "dermis" / "environment" / "data" / "mirrors.csv"
HEAD = """\
# quantity: isotropic lobes whose weighted sum approximates a specular lobe, by its roughness m and the cosine
#   of the view: angle from the normal in the plane of incidence, away from the viewer, angle from that plane
#   ("beside"), roughness and weight
# unit: angles in radians; all others dimensionless
# source: tools/mirror_lobes.py, least squares over the spherical harmonics of environments
# licence: Apache-2.0
"""


def main() -> None:
    """Fit all lobes and write the table."""
    columns = [
        f"{name}_{k}" for k in range(LOBE_COUNT) for name in ("angle", "beside", "roughness", "weight")
    ]
    lines = [",".join(["model", "m", "cosine", *columns])]
    for model in MODELS:
        table = fit_isotropic_lobes(MODELS[model].lobe)
        for i, m in enumerate(LOBE_TABLE_ROUGHNESSES):
            for j, cosine in enumerate(LOBE_TABLE_COSINES):
                values = ",".join(f"{x:.4f}" for x in table[i, j].ravel())
                lines.append(f"{model},{m:.5g},{cosine:.5g},{values}")
    OUT.parent.mkdir(exist_ok=True)
    with atomic_file(OUT) as trial:
        trial.write_text(HEAD + "\n".join([*lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    run_script(main)
