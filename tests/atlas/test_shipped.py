"""The tables in the package are those that the code computes for the package's own head."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from dermis.atlas.atlas import GUTTER_MM
from dermis.atlas.build import build_atlas
from dermis.atlas.interreflection import FormFactors, compute_form_factors, form_factor_table_name
from dermis.atlas.shipped import shipped_arrays
from dermis.atlas.stitched.build import LAYOUT_ARRAY_NAMES, find_stitched_layout, layout_table_name
from dermis.human.model import head_template
from dermis.mesh.mesh import Mesh

ADVICE = "run tools/human_tables.py"
FACTOR_NAMES = [field.name for field in fields(FormFactors)]


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return head_template("own", 1).head.topology_head.mesh


def test_layout_is_that_of_the_package(mesh: Mesh) -> None:
    shipped = shipped_arrays(mesh, layout_table_name(GUTTER_MM), LAYOUT_ARRAY_NAMES)
    assert shipped is not None, ADVICE
    computed = find_stitched_layout(mesh, GUTTER_MM)
    np.testing.assert_array_equal(shipped["piece"], computed["piece"], ADVICE)
    for name in ("scale", "origins"):
        np.testing.assert_allclose(shipped[name], computed[name], rtol=1e-9, err_msg=ADVICE)


@pytest.mark.usefixtures("many_form_factor_lines")
def test_form_factors_are_those_of_the_package(mesh: Mesh) -> None:
    atlas = build_atlas(mesh, 1024, "stitched")
    shipped = shipped_arrays(mesh, form_factor_table_name(atlas.mapped), FACTOR_NAMES)
    assert shipped is not None, ADVICE
    computed = compute_form_factors(mesh, atlas.corner_uv, atlas.mapped)
    for name in FACTOR_NAMES:
        np.testing.assert_array_equal(shipped[name], getattr(computed, name), f"{name}: {ADVICE}")


def test_atlas_of_another_side_has_tables_too(mesh: Mesh) -> None:
    mapped = build_atlas(mesh, 2048, "stitched").mapped
    assert shipped_arrays(mesh, form_factor_table_name(mapped), FACTOR_NAMES) is not None, ADVICE


def test_other_shapes_of_the_topology_have_no_tables(mesh: Mesh) -> None:
    table = layout_table_name(GUTTER_MM)
    positions = mesh.positions.copy()
    positions[1001:1101] += 1.0
    assert shipped_arrays(replace(mesh, positions=positions), table, LAYOUT_ARRAY_NAMES) is None
    assert (
        shipped_arrays(replace(mesh, triangles=mesh.triangles[:, [1, 2, 0]]), table, LAYOUT_ARRAY_NAMES)
        is None
    )
    assert shipped_arrays(mesh, layout_table_name(2 * GUTTER_MM), LAYOUT_ARRAY_NAMES) is None
