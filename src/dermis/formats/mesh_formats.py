"""Registry of mesh formats: their suffixes, readers and properties."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dermis.base.file_properties import FileProperty
from dermis.base.registry import Registry
from dermis.formats.gltf.read_materials import GLTF_MATERIAL_PROPERTIES
from dermis.formats.gltf.triangles import GLTF_PROPERTIES, read_gltf
from dermis.formats.gltf.vrm import VRM_PROPERTIES
from dermis.formats.obj import read_obj
from dermis.formats.obj_geometry import OBJ_PROPERTIES
from dermis.formats.obj_materials import MTL_PROPERTIES
from dermis.formats.parts import MeshFile
from dermis.formats.ply import PLY_PROPERTIES, read_ply
from dermis.formats.stl import STL_PROPERTIES, read_stl
from dermis.formats.usd.read import USD_PROPERTIES, USD_SUFFIXES, read_usd
from dermis.formats.usd.shading import USD_MATERIAL_PROPERTIES


@dataclass(frozen=True)
class MeshFormat:
    """Format of mesh files.

    suffixes : file name suffixes in lower case, with the dot
    read : function that reads a file; may raise any exception for a damaged file
    properties : what the reader does with each property of a file, except properties of materials
    materials : what the reader does with each property of a material
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path], MeshFile]
    properties: tuple[FileProperty, ...]
    materials: tuple[FileProperty, ...] = ()


_GLTF_FILE_PROPERTIES = (*GLTF_PROPERTIES, *VRM_PROPERTIES)
MESH_FORMATS = Registry[MeshFormat](
    "mesh format",
    {
        "gltf": MeshFormat(
            (".glb", ".gltf", ".vrm"), read_gltf, _GLTF_FILE_PROPERTIES, GLTF_MATERIAL_PROPERTIES
        ),
        "obj": MeshFormat((".obj",), read_obj, OBJ_PROPERTIES, MTL_PROPERTIES),
        "ply": MeshFormat((".ply",), read_ply, PLY_PROPERTIES),
        "stl": MeshFormat((".stl",), read_stl, STL_PROPERTIES),
        "usd": MeshFormat(USD_SUFFIXES, read_usd, USD_PROPERTIES, USD_MATERIAL_PROPERTIES),
    },
)


def find_format(path: str | Path) -> MeshFormat | None:
    """Return the format of a mesh file by its suffix; None for an unknown suffix."""
    suffix = Path(path).suffix.lower()
    return next((one for one in MESH_FORMATS.values() if suffix in one.suffixes), None)


def mesh_suffixes() -> tuple[str, ...]:
    """Return the suffixes of all mesh formats."""
    return tuple(suffix for one in MESH_FORMATS.values() for suffix in one.suffixes)
