"""Every model of the surface by its name, behind one protocol."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Protocol

from dermis.base.registry import RegisteredName, Registry

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from dermis.specular.cosines import Cosines, Floats
    from dermis.specular.fresnel import Fresnel


class Lobe(Protocol):
    """BRDF for rho_s = 1, without the cosine [1/sr], 0 unless light and view are above the surface."""

    def __call__(self, angles: Cosines, m: ArrayLike, fresnel: Fresnel = ...) -> Floats:
        """m : roughness, broadcast against the angles [-]."""


@dataclass(frozen=True)
class Model:
    """A lobe and what is to be said of it.

    Its shader lies beside the lobe's module under the same name and has `fn NAME(a: Angles, m: f32) -> f32`,
    NAME as in scene files, with underscores for hyphens.

    note : what the model is; for one that is not reciprocal, why
    reciprocal : whether light and view may change places
    sources : keys of the bibliography
    numbers : constants that its shader fills in
    """

    lobe: Lobe
    note: str
    reciprocal: bool
    sources: tuple[str, ...]
    numbers: Mapping[str, float] = field(default_factory=dict)

    @property
    def shader(self) -> Path:
        """The file of its shader."""
        return Path(inspect.getfile(self.lobe)).with_suffix(".wgsl")


MODELS: Registry[Model] = Registry(
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
"""By the names that scenes use, the default first; imported when needed: a command's help is quick."""

SpecularName = Annotated[str, RegisteredName(MODELS, "none")]
FresnelName = Literal["schlick", "exact"]
EnergyName = Literal["none", "published", "full"]
