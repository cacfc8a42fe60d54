"""Materials of mesh files: their pictures, the mapping of pictures to the surface, and constant values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.base.reading import is_file
from dermis.formats.maps import PathLike
from dermis.images.io import EmbeddedPicture, read_size
from dermis.images.sizes import MAX_TOTAL_PIXELS

Wrap = Literal["repeat", "mirror", "clamp"]
Role = Literal["colour", "normal", "height", "roughness", "metalness", "specular", "emission", "opacity"]
AlphaMode = Literal["opaque", "mask", "blend"]
UvTransform = tuple[float, float, float, float, float, float]

_BLENDED_OPACITY_CUTOFF = 0.5
IDENTITY_UV_TRANSFORM: UvTransform = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Texture:
    """Picture of a material, with its mapping to the surface.

    uv_set : index of the uv set of the mesh
    uv_transform : (a, b, c, d, e, f) with u' = a u + b v + c and v' = d u + e v + f, where v points down
    wrap : how the texture continues beyond the edges of the picture, along u and along v
    channel : index of the picture's channel that is used; None for colours, normals and grey pictures
    """

    picture: PathLike
    uv_set: int = 0
    uv_transform: UvTransform = IDENTITY_UV_TRANSFORM
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    channel: int | None = None

    @property
    def uv_mapping(self) -> tuple[int, UvTransform]:
        """Return the uv set and the transform, which determine the texture coordinates."""
        return self.uv_set, self.uv_transform

    def map_uv(self, uv: Doubles) -> Doubles:
        """Convert uv coordinates (n, 2), with v down, to positions (n, 2) in the picture, from 0 to 1."""
        a, b, c, d, e, f = self.uv_transform
        return np.asarray(uv @ np.array([[a, d], [b, e]]) + [c, f])


@dataclass(frozen=True)
class FileMaterial:
    """Material of a mesh file, described by the parameters of glTF's metallic-roughness model.

    name : name of the material, empty if there is none
    textures : pictures by role; their values are multiplied by the fields `colour`, `alpha` and so on
    colour : linear base colour [-]; None if not stated
    alpha : opacity [-]
    roughness : perceptual roughness, the square root of the width alpha of GGX [-]; None if not stated
    stated_metalness : factor of the metalness [-]; None if not stated, so that glTF's default of 1 applies
    emission : glTF's emissiveFactor
    normal_scale : glTF's normalTexture.scale
    scatters : whether the file states that light scatters below the surface
    maps : keyword arguments of `load_maps`, stored only in files that this package wrote; they replace
        `textures`; None for other files
    skin_only : names of properties that have an effect only on skin
    missing : dictionary from role to a sentence on the missing picture
    unused : names of properties that have no effect in this package, for a note to the user
    """

    name: str = ""
    textures: Mapping[Role, Texture] = field(default_factory=dict)
    colour: tuple[float, float, float] | None = None
    alpha: float = 1.0
    alpha_mode: AlphaMode = "opaque"
    alpha_cutoff: float = 0.5
    roughness: float | None = None
    stated_metalness: float | None = 0.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal_scale: float = 1.0
    scatters: bool = False
    maps: Mapping[str, object] | None = None
    skin_only: tuple[str, ...] = ()
    missing: Mapping[str, str] = field(default_factory=dict)
    unused: tuple[str, ...] = ()

    @property
    def metalness(self) -> float:
        """Return the metalness factor, which is 1 if the file states none [-]."""
        return 1.0 if self.stated_metalness is None else self.stated_metalness

    @property
    def opacity_cutoff(self) -> float:
        """Return the opacity below which the surface is cut away; blended materials are also cut."""
        return self.alpha_cutoff if self.alpha_mode == "mask" else _BLENDED_OPACITY_CUTOFF

    def skin_pictures(self) -> dict[str, object]:
        """Return the pictures of a skin material as keyword arguments of `load_maps`."""
        if self.maps is not None:
            return dict(self.maps)
        return {role: self.textures[role].picture for role in ("colour", "normal") if role in self.textures}


def check_pictures(path: Path, materials: Iterable[FileMaterial]) -> None:
    """Refuse materials whose pictures have too many texels in total.

    path : path of the file, for error messages
    """
    pictures: dict[tuple[str, str], object] = {}
    for material in materials:
        used = dict(material.maps or {}) | {role: one.picture for role, one in material.textures.items()}
        pictures |= {(role, str(picture)): picture for role, picture in used.items()}
    texels = 0
    for picture in pictures.values():
        if isinstance(picture, EmbeddedPicture | Path):
            source = picture.data if isinstance(picture, EmbeddedPicture) else picture
            if isinstance(source, bytes) or is_file(str(source)):
                width, height = read_size(picture)
                texels += width * height
    if texels > MAX_TOTAL_PIXELS:
        advice = "Resize them, or set them by options (--colour, ...)"
        limit = f"textures of at most {MAX_TOTAL_PIXELS / 1e6:.0f} million texels together"
        refuse(path, limit, f"they have {texels / 1e6:.0f} million", advice)
