"""Hair as Mitsuba's B-spline curves with Mitsuba's hair material."""

from __future__ import annotations

from collections.abc import Sequence

from dermis.apps.export.hair_curves import CurveGroup
from dermis.apps.truths.person.shapes import curves_text, fibre_bsdf
from dermis.apps.truths.scene_description import SceneDict


def hair_shape(curve_group: CurveGroup) -> SceneDict:
    """Return Mitsuba's description of a group of hairs; the curves are in the file `hair_file`."""
    bsdf = fibre_bsdf(curve_group.optical_depth)
    return {"type": "bsplinecurve", "filename": hair_file(curve_group.name), "bsdf": bsdf}


def hair_files(curve_groups: Sequence[CurveGroup]) -> dict[str, bytes]:
    """Return the files of curves, as a dictionary from file name to content."""
    return {
        hair_file(group.name): curves_text(group.knots_mm, group.radius_mm).encode("ascii")
        for group in curve_groups
    }


def hair_file(group_name: str) -> str:
    """Return the path of the file with the curves of a group, relative to the scene file."""
    return f"hairs/{group_name}.txt"
