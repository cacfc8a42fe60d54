"""Expressions of a head as variants of its USD stage."""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdSkel

from dermis.human.expressions import available_expressions, expression
from dermis.mesh.pose import Pose
from dermis.mesh.rig import Rig

VARIANT_SET = "expression"
NEUTRAL = "neutral"


def add_expressions(head_prim: Usd.Prim, animation: UsdSkel.Animation, rig: Rig) -> None:
    """Add a variant for each named expression that the rig has, and select the neutral one.

    A variant sets the weights of all blend shapes in the animation. A head without the targets of any
    expression has the neutral variant only.

    head_prim : prim above the animation, which gets the variant set "expression"
    """
    if not rig.targets.names:
        return
    rest = np.zeros(len(rig.targets.names)) if rig.targets.rest is None else rig.targets.rest
    weights = {NEUTRAL: rest}
    for name in available_expressions(rig.targets.names):
        if name != NEUTRAL:
            weights[name] = rest + Pose(weights=expression(name)).to_arrays(rig).weights
    variants = head_prim.GetVariantSets().AddVariantSet(VARIANT_SET)
    for name, values in weights.items():
        variant = name.replace("-", "_")
        variants.AddVariant(variant)
        variants.SetVariantSelection(variant)
        with variants.GetVariantEditContext():
            animation.CreateBlendShapeWeightsAttr(values.astype(np.float64).tolist())
    variants.SetVariantSelection(NEUTRAL)
