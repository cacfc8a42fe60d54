"""The interface of a kind of light for the frame; its shader lies beside its module."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any, Generic, TypeVar

from numpy.typing import ArrayLike

from dermis.base.registry import Registry
from dermis.frame.projection import Triple, axes_of, between
from dermis.gpu.wgsl_source import Member
from dermis.mesh.head import Head
from dermis.scene.lights import Light, PointLight

Members = dict[str, ArrayLike]
"""Members of a shader's struct, by their names."""
L = TypeVar("L", bound=Light)


class Kind(Generic[L]):
    """A kind of light; by default all of it comes from one place or, where it is parallel, in one direction.

    Its shader lies beside its module under the same name and has
    `fn NAME_incident(light: Light, p: vec3f, part: u32) -> Incident`,
    NAME as in scene files, with underscores for hyphens.

    always : whether all shaders have it; others are compiled only for scenes that use them
    narrow : whether all of it comes from its position or along its direction; else it is an area light
    round : whether it is a disc as seen from the head, not a rectangle
    sheet : whether it is a Gaussian across `half_u`, so that details finer than texels are known
    """

    always = False
    narrow = True
    round = True
    sheet = False

    @property
    def shader(self) -> Path:
        """The file of its shader."""
        return Path(inspect.getfile(type(self))).with_suffix(".wgsl")

    def has_size(self, light: L) -> bool:
        """Whether its shadows soften with the distance from the occluder."""
        return not self.narrow

    def parts(self, light: L) -> list[Light]:
        """Lights that together make up this one, each with a shadow map of its own."""
        return [light]

    def check(self, light: L, head: Head, culprit: str) -> None:
        """Raise DermisError if the light cannot stand where it is."""

    def members(self, light: L, centre: Triple, distance: float) -> Members:
        """Members of the shader's `Light` that are this kind's own.

        centre : of the head [mm]
        distance : from the light to its target, 1 for parallel light [mm]
        """
        return {}


KINDS: Registry[Kind[Any]] = Registry(
    "light of the frame",
    {
        shader.stem.replace("_", "-"): f"{__package__}.{shader.stem}:KIND"
        for shader in sorted(Path(__file__).parent.glob("*.wgsl"))
    },
    f"Register how it is drawn in {__name__}.KINDS",
)
"""By the names of scene files: each shader of this folder, with the module beside it."""


def facing(light: PointLight, radiance: float, half_width: float, half_height: float) -> Members:
    """Members of an area light that faces its target; `irradiance` holds its radiance.

    radiance : for an irradiance of 1 at the target [1/sr]
    half_width, half_height : [mm]
    """
    right, up, _ = axes_of(between(light.position, light.target))
    return {
        "half_u": tuple(half_width * c for c in right),
        "half_v": tuple(half_height * c for c in up),
        "extent": (half_width, half_height),
        "irradiance": tuple(radiance * c for c in light.irradiance),
    }


def override_of(name: str) -> str:
    """The shaders' `override` for a kind, by its name in scene files."""
    return f"{name.replace('-', '_').upper()}_LIGHT"


def light_shaders() -> list[Member]:
    """The kinds as lights.wgsl includes them."""
    return [
        Member(name, kind.shader, (("override", override_of(name)), ("always", str(kind.always).lower())))
        for name, kind in KINDS.items()
    ]
