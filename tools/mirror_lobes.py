"""Makes src/dermis/environment/data/mirrors.csv: surface lobes as round ones about the plane of view.

Takes two or three minutes. `dermis.environment.mirror_fits` says how they are found.
"""

from __future__ import annotations

from pathlib import Path

from dermis.base.atomic_write import replacing
from dermis.base.command_line import run_script
from dermis.environment.mirror_fits import LOBES, MIRROR_ROUGHNESSES, MIRROR_VIEWS, fitted_mirrors
from dermis.specular.models import MODELS

OUT = Path(__file__).parent.parent / "src" / "dermis" / "environment" / "data" / "mirrors.csv"
HEAD = """\
# quantity: round lobes whose weighted sum stands for a surface's, by its roughness m and the view's cosine:
#   angle from the normal in the plane of view, away from the eye, angle beside that plane, roughness,
#   and share of the light
# unit: angles in radians; all others dimensionless
# source: tools/mirror_lobes.py, least squares over the harmonics of skies
# licence: Apache-2.0
"""


def main() -> None:
    """Fit all and write the table."""
    columns = [f"{name}_{k}" for k in range(LOBES) for name in ("angle", "beside", "roughness", "weight")]
    lines = [",".join(["model", "m", "cosine", *columns])]
    for model in MODELS:
        table = fitted_mirrors(MODELS[model].lobe)
        for i, m in enumerate(MIRROR_ROUGHNESSES):
            for j, cosine in enumerate(MIRROR_VIEWS):
                values = ",".join(f"{x:.4f}" for x in table[i, j].ravel())
                lines.append(f"{model},{m:.5g},{cosine:.5g},{values}")
    OUT.parent.mkdir(exist_ok=True)
    with replacing(OUT) as trial:
        trial.write_text(HEAD + "\n".join([*lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    run_script(main)
