"""Loading of sample heads and of heads in mesh files, with their maps."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from dermis.base.errors import notify, refuse
from dermis.formats.gltf.embedded import embedded_eye_look, embedded_materials
from dermis.formats.load import RiggedMesh, load_rigged
from dermis.formats.maps import load_maps
from dermis.formats.materials import FileMaterial
from dermis.formats.mesh_checks import check_uv_range
from dermis.formats.obj import obj_maps
from dermis.formats.parts import is_gltf
from dermis.formats.samples import SAMPLES, Sample, fetch_sample
from dermis.formats.units import with_positions_in_mm
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.scene.file_surfaces import (
    unpacked_skin_material,
    unused_properties,
    with_file_textures,
    with_generated_uv,
    with_material_factors,
)
from dermis.scene.head_table import NormalY, check_relief
from dermis.scene.skin_tone import SKIN_WITHOUT_COLOUR_MAP, with_skin_tone

MapFile = str | os.PathLike[str] | None


@dataclass(frozen=True)
class MapOptions:
    """Maps that users choose for the skin.

    files : dictionary from the role of each map, such as "colour", to the user's picture file, or to None if
        the mesh file's picture is kept
    height_mm : height of one grey level of the height map, see `load_maps` [mm]
    normal_y : direction of green in the normal map, see `load_maps`
    skin_site : name of a measured skin colour, used for skin without a colour map; see `measured_tone`
    """

    files: Mapping[str, MapFile]
    height_mm: float | None = None
    normal_y: NormalY = "up"
    skin_site: str | None = None

    @property
    def user_files(self) -> dict[str, MapFile]:
        """Return a dictionary from map roles, such as "colour", to the files that the user has chosen."""
        return {role: file for role, file in self.files.items() if file is not None}

    @property
    def replaced_roles(self) -> set[str]:
        """Return the map roles, such as "colour", for which the user replaces the mesh file's pictures."""
        relief = {"normal", "height", "bump"}
        return {*self.user_files, *(relief if relief & self.user_files.keys() else ())}

    def load(self, mesh_pictures: Mapping[str, Any]) -> Maps:
        """Load the skin maps: the user's picture for each map role, or else the mesh file's picture.

        mesh_pictures : dictionary from map roles, such as "colour", to pictures of the mesh file; its entry
            "height_mm" is the height of one grey level of the height map [mm]
        """
        chosen: dict[str, Any] = {
            role: mesh_pictures.get(role) if file is None else file for role, file in self.files.items()
        }
        chosen["region"] = mesh_pictures.get("region")
        used: dict[str, Any] = {role: file for role, file in chosen.items() if file is not None}
        return load_maps(**used, height_mm=self.grey_level_height_mm(mesh_pictures), normal_y=self.normal_y)

    def grey_level_height_mm(self, mesh_pictures: Mapping[str, Any]) -> float | None:
        """Return the height of one grey level of the height map, from the user or from the mesh file [mm].

        mesh_pictures : dictionary with the pictures and the "height_mm" of the mesh file, as for `load`
        """
        file_height_mm = mesh_pictures.get("height_mm") if self.files["height"] is None else None
        return file_height_mm if self.height_mm is None else self.height_mm


def load_file_head(
    sample_or_path: str, mesh_options: dict[str, Any], map_options: MapOptions
) -> tuple[Head, EyeLook]:
    """Return the head of a sample or a mesh file, and the look of its eyes.

    The look of the eyes is read from the file. If the file has none, it is the default look.

    sample_or_path : name of a sample head of the package, or path of a mesh file
    mesh_options : keyword arguments of `load_rigged`
    map_options : maps that the user chooses for the skin
    """
    sample = SAMPLES.get(sample_or_path)
    if sample is not None:
        return _load_sample(sample, mesh_options, map_options), EyeLook()
    path, look, materials = Path(sample_or_path), EyeLook(), None
    if is_gltf(path):
        materials, look = embedded_materials(path), embedded_eye_look(path)
    rigged = _load_mesh(path, sample_or_path, mesh_options)
    mesh, maps, notes = _with_materials(
        rigged, rigged.materials if materials is None else materials, path, map_options
    )
    check_uv_range(mesh, path)
    check_relief(map_options.height_mm, maps.height, f"{sample_or_path}: height_mm")
    maps, tone_note = with_skin_tone(mesh, maps, map_options.skin_site, "colour" in map_options.user_files)
    for note in filter(None, (*rigged.notes, tone_note, *notes)):
        notify(f"{path}: {note}")
    return Head(sample_or_path, mesh, maps, "", rigged.rig, file_vertices=rigged.file_vertices), look


def _load_mesh(path: Path, error_subject: str, mesh_options: dict[str, Any]) -> RiggedMesh:
    rigged = with_generated_uv(load_rigged(path, **mesh_options))
    return with_positions_in_mm(rigged, path, mesh_options["unit_mm"], error_subject)


def _load_sample(sample: Sample, mesh_options: dict[str, Any], map_options: MapOptions) -> Head:
    """Return the head of a sample, with the unit and the maps that the registry of samples states."""
    if sample.kind != "head":
        hint = f"Use one of {', '.join(name for name, one in SAMPLES.items() if one.kind == 'head')}"
        refuse(sample.name, "a head", f"this sample is an {sample.kind}", hint)
    files = fetch_sample(sample.name)
    if map_options.skin_site is not None:
        refuse("skin_site", SKIN_WITHOUT_COLOUR_MAP, f"{sample.name} has a colour map", "Leave it out")
    sample_options = mesh_options | {"unit_mm": mesh_options["unit_mm"] or sample.unit_mm}
    if sample_options["v_origin"] == "auto":
        sample_options["v_origin"] = sample.v_origin or "auto"
    with ThreadPoolExecutor(1) as pool:
        pending_maps = pool.submit(map_options.load, {**files, "height_mm": sample.height_mm})
        rigged = _load_mesh(files["mesh"], sample.name, sample_options)
        maps = pending_maps.result()
    check_relief(map_options.height_mm, maps.height, f"{sample.name}: height_mm")
    credit = f"{sample.attribution}, {sample.licence}"
    return Head(sample.name, rigged.mesh, maps, credit, rigged.rig, file_vertices=rigged.file_vertices)


def _with_materials(
    rigged: RiggedMesh, materials: Sequence[FileMaterial], path: Path, map_options: MapOptions
) -> tuple[Mesh, Maps, list[str]]:
    """Return the mesh and the maps of a file with materials, and notes for the user.

    The notes name properties of the materials that are not drawn.
    """
    direct = unpacked_skin_material(rigged, materials)
    pack_skin = direct is None and not map_options.user_files
    mesh, packed, notes = with_file_textures(rigged, materials, pack_skin)
    loaded, faults = _unpacked_maps(path, direct or FileMaterial(), map_options)
    roles = [one.name for one in fields(Maps)]
    loaded_maps = {role: one for role in roles if (one := getattr(loaded, role)) is not None}
    maps = replace(packed, **loaded_maps)
    unused = unused_properties(mesh, materials, rigged.surface.in_file, map_options.replaced_roles, pack_skin)
    return mesh, maps, [*notes, *faults, unused]


def _unpacked_maps(path: Path, material: FileMaterial, map_options: MapOptions) -> tuple[Maps, list[str]]:
    """Return skin maps from the pictures of one material, and notes on pictures that are not used."""
    if path.suffix.lower() != ".obj" or not material.name:
        return with_material_factors(
            map_options.load(material.skin_pictures()), material, map_options.user_files
        ), []
    mtl_maps, faults = obj_maps(
        path,
        material.name,
        overridden_roles=map_options.user_files,
        height_mm=map_options.height_mm,
        normal_y=map_options.normal_y,
    )
    loaded = map_options.load({})
    chosen_maps: dict[str, Any] = {role: getattr(loaded, role) for role in map_options.user_files}
    return with_material_factors(
        replace(mtl_maps, **chosen_maps), material, {*map_options.user_files, "normal", "roughness"}
    ), faults
