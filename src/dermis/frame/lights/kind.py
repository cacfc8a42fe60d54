"""Interface of the kinds of lights; each kind is a module with a WGSL file beside it."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any, Generic, TypeVar

from numpy.typing import ArrayLike

from dermis.base.registry import Registry
from dermis.base.renamed import successor
from dermis.frame.projection import Triple, vector_between, view_axes
from dermis.gpu.wgsl_source import ShaderListMember
from dermis.mesh.head import Head
from dermis.scene.lights import Light, PointLight

StructMembers = dict[str, ArrayLike]
"""Values of the members of a shader struct, by the names of the members."""
LightT = TypeVar("LightT", bound=Light)


class LightKind(Generic[LightT]):
    """Kind of light. This base class is a punctual light that needs no additional shader members.

    The shader has the name of the module, with the suffix .wgsl. It defines the following function, where
    NAME is the name of the kind in scene files, with hyphens replaced by underscores:

        fn NAME_incident(light: Light, p: vec3f, part: u32) -> Incident

    The function returns the light that arrives at the point p from one part of the light, see `light_parts`.

    Attributes
    ----------
    always : bool
        Whether all shaders include this kind of light; if False, only shaders of scenes that use it do.
    punctual : bool
        Whether all light comes from one position or from one direction; False for area lights.
    round : bool
        Whether the light has the shape of a disc as seen from the head; False for a rectangle.
    sheet : bool
        Whether the light is a thin sheet, whose irradiance is a Gaussian along the shader member `half_u` and
        can be blurred exactly.

    Examples
    --------
    >>> from dermis.frame.lights.kind import KINDS
    >>> KINDS["sphere"].punctual, KINDS["spot"].punctual
    (False, True)
    """

    always = False
    punctual = True
    round = True
    sheet = False

    @property
    def shader(self) -> Path:
        """Return the path of the WGSL file that computes the light at a point."""
        return Path(inspect.getfile(type(self))).with_suffix(".wgsl")

    def has_penumbra(self, light: LightT) -> bool:
        """Return whether shadows of the light soften with the distance from the occluder.

        Parameters
        ----------
        light : Light
            Light of the scene.
        """
        return not self.punctual

    def light_parts(self, light: LightT) -> list[Light]:
        """Divide a light into parts that together equal the light; each part gets a shadow map of its own.

        Parameters
        ----------
        light : Light
            Light of the scene.

        Returns
        -------
        list of Light
            The parts. For kinds that are not divided, the only part is the light itself.
        """
        return [light]

    def check(self, light: LightT, head: Head, error_subject: str) -> None:
        """Check that the light has a valid position.

        Parameters
        ----------
        light : Light
            Light of the scene.
        head : Head
            Head that is lit.
        error_subject : str
            Name of the light in messages.

        Raises
        ------
        DermisError
            When the position is invalid, for example when a spherical light overlaps the head.
        """

    def shader_members(self, light: LightT, head_centre: Triple, target_distance: float) -> StructMembers:
        """Return the members of the shader struct `Light` that only this kind sets.

        Parameters
        ----------
        light : Light
            Light of the scene.
        head_centre : tuple of float
            Centre of the head [mm].
        target_distance : float
            Distance from the light to its target, 1 for parallel light [mm].

        Returns
        -------
        dict
            Dictionary from the name of a member to its value.
        """
        return {}


KINDS: Registry[LightKind[Any]] = Registry(
    "light of the frame",
    {
        shader.stem.replace("_", "-"): f"{__package__}.{shader.stem}:KIND"
        for shader in sorted(Path(__file__).parent.glob("*.wgsl"))
    },
    f"Register its LightKind in {__name__}.KINDS",
)
"""Kinds of lights by their names in scene files; each has a module and a shader in this folder."""


def area_light_members(
    light: PointLight, radiance: float, half_width_mm: float, half_height_mm: float
) -> StructMembers:
    """Return the members of the shader struct `Light` for an area light that faces its target.

    radiance : radiance that gives an irradiance of 1 at the target [1/sr]
    half_width_mm, half_height_mm : half the width and half the height of the light [mm]
    """
    right, up, _ = view_axes(vector_between(light.position, light.target))
    return {
        "half_u": tuple(half_width_mm * c for c in right),
        "half_v": tuple(half_height_mm * c for c in up),
        "extent": (half_width_mm, half_height_mm),
        "irradiance": tuple(radiance * c for c in light.irradiance),
    }


def kind_constant_name(kind_name: str) -> str:
    """Return the name of the pipeline constant that enables a kind of light in shaders.

    kind_name : name of the kind in scene files
    """
    return f"{kind_name.replace('-', '_').upper()}_LIGHT"


def light_shaders() -> list[ShaderListMember]:
    """Return the shaders of all kinds of lights, in the order of their numbers in lights.wgsl."""
    return [
        ShaderListMember(
            name, kind.shader, (("override", kind_constant_name(name)), ("always", str(kind.always).lower()))
        )
        for name, kind in KINDS.items()
    ]


def __getattr__(name: str) -> Any:
    """Return an object of this module by the name that it had in the last release, for compatibility."""
    if new := successor(__name__, name):
        return globals()[new]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
