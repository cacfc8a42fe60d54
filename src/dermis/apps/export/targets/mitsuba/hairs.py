"""Hair as B-spline curves of Mitsuba, with its material of hair fibres."""

from __future__ import annotations

from collections.abc import Sequence

from dermis.apps.export.hair_curves import CurveGroup
from dermis.apps.truths.person.shapes import curves_text, fibre_bsdf
from dermis.apps.truths.scene_description import SceneDict


def hair_shape(curve_group: CurveGroup) -> SceneDict:
    """Return Mitsuba's description of a group of hairs, whose curves are in `hair_file`."""
    bsdf = fibre_bsdf(curve_group.optical_depth)
    return {"type": "bsplinecurve", "filename": hair_file(curve_group.name), "bsdf": bsdf}


def hair_files(curve_groups: Sequence[CurveGroup]) -> dict[str, bytes]:
    """Return a dictionary from name to content of the files of curves."""
    return {
        hair_file(group.name): curves_text(group.knots_mm, group.radius_mm).encode("ascii")
        for group in curve_groups
    }


def hair_file(group_name: str) -> str:
    """Return the name of the file with the curves of a group."""
    return f"hairs/{group_name}.txt"
