"""Hair as pbrt's B-spline curves with pbrt's material `hair`."""

from __future__ import annotations

import numpy as np

from dermis.apps.export.hair_curves import CurveGroup
from dermis.apps.export.targets.pbrt.scene import DirectiveParameters, Lines, format_directive
from dermis.apps.truths.person.shapes import (
    AZIMUTHAL_ROUGHNESS,
    CUTICLE_TILT_DEGREES,
    KERATIN_IOR,
    LONGITUDINAL_ROUGHNESS,
    bspline_control_points,
)


def hair_directives(curve_group: CurveGroup) -> Lines:
    """Return the directives of a group of hairs: a material, and a shape for each hair.

    The material measures lengths in radii of a fibre. The width of a curve varies linearly
    from its root to its tip; hair below headwear has the width of its visible part.
    """
    material: DirectiveParameters = {
        "rgb sigma_a": curve_group.optical_depth,
        "float eta": KERATIN_IOR,
        "float beta_m": LONGITUDINAL_ROUGHNESS,
        "float beta_n": AZIMUTHAL_ROUGHNESS,
        "float alpha": CUTICLE_TILT_DEGREES,
    }
    points = bspline_control_points(curve_group.knots_mm)
    radius_mm = curve_group.radius_mm.astype(np.float64)
    ends = 2.0 * np.where(radius_mm > 0.0, radius_mm, radius_mm.max(axis=1, keepdims=True))[:, [0, -1]]
    shapes = [
        format_directive(
            "Shape",
            "curve",
            {
                "string type": "cylinder",
                "string basis": "bspline",
                "integer degree": 3,
                "point3 P": curve,
                "float width0": first,
                "float width1": last,
            },
        )
        for curve, (first, last) in zip(points, ends, strict=True)
    ]
    return ["AttributeBegin", format_directive("Material", "hair", material), *shapes, "AttributeEnd"]
