"""The true profile of a skin, as well as it is known."""

from __future__ import annotations

from typing import Literal, get_args

from dermis.base.errors import refuse, shown_value
from dermis.optics.counted import counted_curve
from dermis.optics.curve import Curve
from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.profiles import find_table
from dermis.optics.radial import RadialProfile, profile_of_table
from dermis.optics.tissue import Tissue
from dermis.scene.skin import Skin
from dermis.scene.tissue import tissue_of

ModelName = Literal["montecarlo", "layered", "multipole", "dipole", "better-dipole"]
MODELS: tuple[ModelName, ...] = get_args(ModelName)
_PHOTONS = 1_000_000


def true_curve(skin: Skin, model: ModelName | None = None) -> tuple[Curve, str, Tissue | None]:
    """The curve of a skin's profile, the model that it is by, and its tissue.

    model : by default Monte Carlo for homogeneous media by name, which the package has tables of, layered
        diffusion for other tissue, and for a table of Gaussians the table

    DermisError : an unknown model, or one for a table of Gaussians
    """
    if model is not None and model not in MODELS:
        refuse("model", f"one of {', '.join(MODELS)}", f"{shown_value(model)} came", "Choose one of them")
    table = None if skin.has_own_tissue else find_table(skin.profile)
    if table is not None:
        if model is not None:
            refuse("model", "a tissue", f"{skin.profile} is a table of Gaussians", "Leave it out")
        return Curve.of_profile(profile_of_table(table)), "table", None
    tissue = tissue_of(skin)
    if model in (None, "montecarlo") and (counted := _counted(tissue)) is not None:
        return counted, "montecarlo", tissue
    used: ModelName = model or "layered"
    entering = 1.0 if tissue.rgb is None else 1.0 - normal_reflectance(tissue.medium.eta)
    return Curve.of_profile(_profile(tissue, used), entering), used, tissue


def _counted(tissue: Tissue) -> Curve | None:
    return counted_curve(tissue.medium) if tissue.rgb is None else None


def _profile(tissue: Tissue, model: ModelName) -> RadialProfile:
    if model != "montecarlo":
        return tissue.profile(model)
    from dermis.apps.validation.truths.slab_mc import counted_profile

    return counted_profile(tissue.medium, tissue.rgb, _PHOTONS)
