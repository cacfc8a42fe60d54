"""Make src/dermis/atlas/data: tables of the package's own head that take seconds to compute."""

from __future__ import annotations

import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas import shipped
from dermis.atlas.atlas import GUTTER_MM
from dermis.atlas.build import build_atlas
from dermis.atlas.interreflection import FormFactors, compute_form_factors, form_factor_table_name
from dermis.atlas.stitched.build import find_stitched_layout, layout_table_name
from dermis.base.command_line import run_script
from dermis.human.model import head_template
from dermis.mesh.mesh import Mesh

OUT = Path(shipped.__file__).parent / "data"
LEVELS = 1  # of subdivision, of a portrait
SIDES = 1024, 2048  # of the atlas [texel]


def main() -> None:
    """Compute the tables and write them."""
    mesh = head_template("own", LEVELS).head.topology_head.mesh
    path = OUT / shipped.table_file_name(mesh)
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)  # `build_atlas` would use the old tables
    np.savez_compressed(path, allow_pickle=False, **shipped.table_file_arrays(mesh, tables(mesh)))
    sys.stdout.write(f"{path}  {path.stat().st_size:,} bytes\n")


def tables(mesh: Mesh) -> dict[str, dict[str, NDArray[Any]]]:
    """Return the tables of a mesh by name: the layout of the atlas, and form factors for each side."""
    found = {layout_table_name(GUTTER_MM): find_stitched_layout(mesh, GUTTER_MM)}
    for side in SIDES:
        atlas = build_atlas(mesh, side, "stitched")
        factors = compute_form_factors(mesh, atlas.corner_uv, atlas.mapped)
        names = [field.name for field in fields(FormFactors)]
        found[form_factor_table_name(atlas.mapped)] = {name: getattr(factors, name) for name in names}
    return found


if __name__ == "__main__":
    run_script(main)
