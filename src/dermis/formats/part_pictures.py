"""Pictures of the parts of a head that are not skin, encoded in the forms that other programs read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from dermis.base.arrays import Bytes, Floats, Numbers
from dermis.images.codecs import encode_png
from dermis.images.colour import encode_srgb8
from dermis.mesh.head import Head
from dermis.mesh.maps import PartMaps
from dermis.mesh.mesh import Material, Mesh

PartRole = Literal[
    "colour", "cutout", "opacity", "roughness", "metalness", "surface", "alpha", "normal", "emission"
]
"""Content of a picture. "colour": sRGB; "cutout": sRGB with opacity, cut out at 0.5; "opacity": 0 or 1;
"roughness": perceptual; "surface": roughness in green and metalness in blue, as in glTF; "alpha": width of
the distribution of normals, the square of the roughness; "normal": green up; "emission": sRGB, relative to
its maximum."""


@dataclass(frozen=True, eq=False)
class PartPictures:
    """Pictures of the parts of a mesh that are not skin, in the uv layout that these parts share."""

    mesh: Mesh
    maps: PartMaps

    @classmethod
    def from_head(cls, head: Head) -> PartPictures | None:
        """Return the pictures of a head's parts that are not skin; None for a head without maps of parts."""
        return None if head.maps.parts is None else cls(head.mesh, head.maps.parts)

    def needed_roles(self, material: Material) -> set[PartRole]:
        """Return the roles, such as "colour" and "normal", of the pictures that a material needs."""
        is_cut, is_metal = material.opacity_cutoff > 0.0, material.metalness > 0.0
        is_rough = material.roughness is not None
        needed: dict[PartRole, bool] = {
            "colour": True,
            "cutout": is_cut,
            "opacity": is_cut,
            "roughness": is_rough,
            "alpha": is_rough,
            "metalness": is_metal,
            "surface": is_rough or is_metal,
            "normal": self._has_normals,
            "emission": self.maps.emission is not None and max(material.emission) > 0.0,
        }
        return {role for role, used in needed.items() if used} if material.has_maps else set()

    def encode(self, roles: Iterable[PartRole]) -> dict[PartRole, bytes]:
        """Return the pictures as 8-bit PNG files by role; roles that no part needs are left out."""
        parts = [self.mesh.materials[index] for index in np.unique(self.mesh.material)]
        used = set[PartRole]().union(*map(self.needed_roles, parts))
        levels = {role: _ENCODER_OF_ROLE[role](self.maps) for role in roles if role in used}
        with ThreadPoolExecutor() as pool:  # compression releases the interpreter lock
            return dict(zip(levels, pool.map(encode_png, levels.values()), strict=True))

    def emission_strength_and_colour(self, material: Material) -> tuple[float, tuple[float, ...]]:
        """Return the emission of a part as a strength and a colour; their product is a radiance.

        With an emission map, the strength is the largest radiance in the map and the colour is white. Without
        a map, strength times colour is the emission of the material.
        """
        if self.maps.emission is not None:
            return float(self.maps.emission.max()), (1.0, 1.0, 1.0)
        strength = max(material.emission)
        return strength, tuple(value / strength for value in material.emission)

    @cached_property
    def _has_normals(self) -> bool:
        return bool(self.maps.surface[..., :2].any())


def encode_normals8(surface_slopes: Floats) -> Bytes:
    """Return the tangent-space normal map (h, w, 3) of slopes (h, w, 2) as 8-bit levels, green up."""
    normal = np.concatenate([-surface_slopes, np.ones_like(surface_slopes[..., :1])], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return encode_linear8(0.5 * normal + 0.5)


def encode_linear8(linear_values: Numbers) -> Bytes:
    """Return values from 0 to 1, of any shape, as 8-bit levels without sRGB encoding."""
    return np.asarray(np.rint(np.clip(linear_values, 0, 1) * 255), np.uint8)


def _encode_colours8(maps: PartMaps) -> Bytes:
    return encode_srgb8(maps.colour[..., :3])


def _encode_roughness_metalness8(maps: PartMaps) -> Bytes:
    return np.pad(encode_linear8(maps.surface[..., 2:]), ((0, 0), (0, 0), (1, 0)))


def _encode_emission8(maps: PartMaps) -> Bytes:
    assert maps.emission is not None
    return encode_srgb8(maps.emission / maps.emission.max())


_ENCODER_OF_ROLE: Mapping[PartRole, Callable[[PartMaps], Bytes]] = {
    "colour": _encode_colours8,
    "cutout": lambda maps: np.concatenate(
        [_encode_colours8(maps), encode_linear8(maps.colour[..., 3:])], axis=2
    ),
    "opacity": lambda maps: np.uint8(255) * (maps.colour[..., 3:] >= 0.5),
    "roughness": lambda maps: encode_linear8(maps.surface[..., 2:3]),
    "alpha": lambda maps: encode_linear8(maps.surface[..., 2:3] ** 2),
    "metalness": lambda maps: encode_linear8(maps.surface[..., 3:]),
    "surface": _encode_roughness_metalness8,
    "normal": lambda maps: encode_normals8(maps.surface[..., :2]),
    "emission": _encode_emission8,
}
