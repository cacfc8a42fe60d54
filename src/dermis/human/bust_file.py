"""From a few numbers to a head with maps: shape, layout, paint, and one file of it all."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.disk import cache_folder, stored_file
from dermis.errors import refuse
from dermis.human.bust import BUSTS
from dermis.human.bust.mesh import bust_mesh, many_charts_mesh
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.regions import REGIONS
from dermis.human.skin_maps.look import SkinLook
from dermis.human.skin_maps.paint import Painted, paint_skin
from dermis.images.codecs import encode_png8, encode_png16
from dermis.images.colour import encode_srgb8
from dermis.images.filters import fill_empty
from dermis.mesh.gltf.encode import encode_glb
from dermis.mesh.mesh import Mesh
from dermis.outputs import reason, replacing

Floats = NDArray[np.float32]
Report = Callable[[int, int], None]

SMALLEST, LARGEST = 256, 4096
_STRIP = 256  # rows painted at a time
_RELIEF_MM = 1.0  # full scale of the height map
_STRENGTH = 0.5  # full scale of the specular map
_MATERIAL = {
    "name": "skin",
    "pbrMetallicRoughness": {
        "baseColorTexture": {"index": "colour"},
        "metallicRoughnessTexture": {"index": "metallic roughness"},
        "metallicFactor": 0.0,
    },
    "normalTexture": {"index": "normal"},
    "extensions": {"KHR_materials_ior": {"ior": 1.4}},
}


@dataclass(frozen=True)
class BustRecipe:
    """Everything that a bust is made from: the same recipe gives the same bytes.

    shape : proportions of the head
    look : pigments and texture of its skin
    size : side of the maps, a power of two from 256 to 4096 [texels]
    layout : "few" charts, or "many", a layout as bad as seams can make it
    """

    shape: BustParameters = field(default_factory=BustParameters)
    look: SkinLook = field(default_factory=SkinLook)
    size: int = 2048
    layout: Literal["few", "many"] = "few"

    def __post_init__(self) -> None:
        if not SMALLEST <= self.size <= LARGEST or self.size & (self.size - 1):
            expected = f"a power of two from {SMALLEST} to {LARGEST}"
            refuse("--size", expected, f"{self.size} came", "Take 1024, 2048 or 4096")


def cached_bust(name: str) -> Path:
    """The file of a built-in head, made on first use and when it is no longer as it was made."""
    recipe = BustRecipe(layout="few" if name == BUSTS[0] else "many")
    digest = hashlib.sha256(f"{recipe} {_code()}".encode()).hexdigest()[:24]
    try:
        return stored_file("bust", f"{name}-{digest}.glb", lambda: encode_bust(recipe))
    except OSError as fault:
        came, hint = f"it cannot be written ({reason(fault)})", "Name a writable one in DERMIS_CACHE"
        refuse(cache_folder() / "bust", "a folder for the cache", came, hint)


def write_bust(path: Path, recipe: BustRecipe, report: Report = lambda done, of: None) -> None:
    """Write a bust as a .glb file, whole or not at all."""
    data = encode_bust(recipe, report)
    with replacing(path) as trial:
        trial.write_bytes(data)


def encode_bust(recipe: BustRecipe, report: Report = lambda done, of: None) -> bytes:
    """The bytes of the .glb file: mesh, colour, normal and roughness for any program, all maps in its extras.

    report : called with the rows done and the rows in all
    """
    mesh = bust_of(recipe)
    atlas = build_atlas(mesh, recipe.size)
    painted = _paint(recipe, mesh, atlas, report)
    pictures = _pictures(painted, atlas)
    roles: dict[str, Any] = {role: {"index": role} for role in ("height", "specular", "roughness", "region")}
    roles |= {"height_mm": _RELIEF_MM / 255, "regions": list(REGIONS), "specular_scale": _STRENGTH}
    roles |= {"shape": asdict(recipe.shape), "look": asdict(recipe.look)}
    return encode_glb(mesh, pictures, _MATERIAL, roles)


def bust_of(recipe: BustRecipe) -> Mesh:
    """The mesh of a recipe, with uv."""
    return bust_mesh(recipe.shape) if recipe.layout == "few" else many_charts_mesh(recipe.shape)


def _paint(recipe: BustRecipe, mesh: Mesh, atlas: Atlas, report: Report) -> Painted:
    """Paint of every texel, (n, n, ...), the empty space filled from beside it."""
    found: dict[str, NDArray[Any]] = {}
    for rows in _strips(recipe.size):
        covered = atlas.coverage[rows]
        places = atlas.interpolate(mesh, np.hstack((mesh.positions, mesh.normals)), rows)[covered]
        texel_mm = 1.0 / np.sqrt(atlas.stretch[rows][covered].astype(np.float64).prod(axis=-1))
        part = paint_skin(places[:, :3], places[:, 3:], recipe.shape, recipe.look, texel_mm)
        for name, values in part._asdict().items():
            shape = (recipe.size, recipe.size, *values.shape[1:])
            found.setdefault(name, np.zeros(shape, values.dtype))[rows][covered] = values
        report(rows.stop, recipe.size)
    return Painted(**found)


def _strips(size: int) -> Iterator[slice]:
    step = min(_STRIP, size)
    return (slice(top, top + step) for top in range(0, size, step))


def _pictures(painted: Painted, atlas: Atlas) -> dict[str, bytes]:
    covered = atlas.coverage
    height = painted.height_mm - painted.height_mm[covered].mean()
    grey = {
        "height": height / _RELIEF_MM + 0.5,
        "specular": painted.rho_s / _STRENGTH,
        "roughness": painted.roughness,
    }
    filled = {name: fill_empty(values[..., None], covered)[..., 0] for name, values in grey.items()}
    slopes = fill_empty(_slopes(filled["height"] * _RELIEF_MM, atlas), covered)
    alpha = filled["roughness"]
    return {
        "colour": encode_png8(encode_srgb8(fill_empty(painted.colour, covered))),
        "normal": encode_png8(_normals(slopes)),
        "metallic roughness": encode_png8(_bytes(np.stack([alpha * 0, np.sqrt(alpha), alpha * 0], axis=-1))),
        "height": encode_png16(np.rint(np.clip(filled["height"], 0, 1) * 65535).astype(np.uint16)[..., None]),
        "specular": encode_png8(_bytes(filled["specular"])[..., None]),
        "roughness": encode_png8(_bytes(alpha)[..., None]),
        "region": encode_png8(painted.region.astype(np.uint8)[..., None]),
    }


def _bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    return np.asarray(np.rint(np.clip(values, 0, 1) * 255), np.uint8)


def _slopes(height_mm: Floats, atlas: Atlas) -> Floats:
    """(n, n, 2) rise to the right and upwards of the map, by the texels' own size [-]."""
    down, right = np.gradient(height_mm)
    return np.stack([right, -down], axis=-1) * atlas.stretch.astype(np.float32)


def _normals(slopes: Floats) -> NDArray[np.uint8]:
    """Tangent-space normals as colours, green up."""
    normal = np.concatenate([-slopes, np.ones_like(slopes[..., :1])], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return _bytes(0.5 * normal + 0.5)


@cache
def _code() -> str:
    """A digest of the generator, so that busts are made again when it changes."""
    package = Path(__file__).parents[1]
    below = ("atlas", "atlas/unwrap", "human", "human/bust", "human/skin_maps", "human/skin_maps/kernels")
    files = [file for folder in below for kind in ("*.py", "*.csv") for file in (package / folder).glob(kind)]
    digest = hashlib.sha256()
    used = (package / name for name in ("mesh/geometry.py", "mesh/gltf/encode.py"))
    for file in sorted((*files, *used)):
        digest.update(file.read_bytes())
    return digest.hexdigest()
