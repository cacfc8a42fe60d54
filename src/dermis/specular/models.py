"""Registry of specular models under the names that scene files use."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol

from dermis.base.registry import RegisteredName, Registry
from dermis.base.renamed import successor

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from dermis.specular.cosines import Cosines, Floats
    from dermis.specular.fresnel import Fresnel


class Lobe(Protocol):
    """Specular BRDF of strength rho_s = 1, without the factor n.l [1/sr].

    The BRDF is 0 if light or viewer is below the surface.
    """

    def __call__(self, cosines: Cosines, m: ArrayLike, fresnel: Fresnel = ...) -> Floats:
        """Return the BRDF for arrays of cosines.

        cosines : cosines between normal, light, view and half vector
        m : roughness, broadcast against the cosines [-]
        fresnel : function that returns the Fresnel reflectance from the cosine v.h between view and half
            vector
        """


@dataclass(frozen=True)
class SpecularModel:
    """Specular model: a lobe, its shader and its description.

    The shader file is named after the lobe's Python module. It defines `fn NAME(a: Angles, m: f32) -> f32`,
    where NAME is the model's name in scene files with underscores for hyphens.

    Parameters
    ----------
    lobe : Lobe
        BRDF in NumPy.
    note : str
        Short description; for a lobe that is not reciprocal, it includes the reason.
    reciprocal : bool
        Whether the BRDF is unchanged when light and view are exchanged.
    sources : tuple of str
        Keys of entries in the bibliography.
    numbers : mapping
        Dictionary from the names of the placeholders in the shader to their values.
    lobes : tuple of float
        Roughness of the narrow and of the wide lobe relative to m, and weight of the narrow lobe [-].

    Examples
    --------
    >>> from dermis.specular.models import MODELS
    >>> MODELS["kelemen"].reciprocal, MODELS["kelemen"].shader.name
    (True, 'kelemen.wgsl')
    """

    lobe: Lobe
    note: str
    reciprocal: bool
    sources: tuple[str, ...]
    numbers: Mapping[str, float] = field(default_factory=dict)
    lobes: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def shader(self) -> Path:
        """Return the path of the WGSL file that implements the lobe."""
        return Path(inspect.getfile(self.lobe)).with_suffix(".wgsl")


MODELS: Registry[SpecularModel] = Registry(
    "surface model",
    {
        "two-lobe": "dermis.specular.two_lobe:TWO_LOBE",
        "kelemen": "dermis.specular.kelemen:KELEMEN",
        "torrance-sparrow": "dermis.specular.torrance_sparrow:TORRANCE_SPARROW",
        "torrance-sparrow-smith": "dermis.specular.torrance_sparrow:TORRANCE_SPARROW_SMITH",
        "blinn-phong": "dermis.specular.blinn_phong:BLINN_PHONG",
        "blinn-phong-plain": "dermis.specular.blinn_phong:BLINN_PHONG_PLAIN",
        "phong": "dermis.specular.phong:PHONG",
        "phong-plain": "dermis.specular.phong:PHONG_PLAIN",
        "kelemen-direct": "dermis.specular.kelemen:KELEMEN_DIRECT",
    },
)
"""Specular models by their names in scene files, the default first; imported on first use."""

SpecularName = Annotated[str, RegisteredName(MODELS, "none")]
FresnelName = Literal["schlick", "exact"]
EnergyConservationName = Literal["none", "published", "full"]


def __getattr__(name: str) -> Any:
    """Return an object of this module by the name that it had in the last release, for compatibility."""
    if new := successor(__name__, name):
        return globals()[new]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
