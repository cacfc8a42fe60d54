"""Folders for Unity and Unreal Engine: contents and references, by parsers; no engine runs."""

from __future__ import annotations

import ast
import io
import json
import re
import runpy
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
import yaml
from gltf_rules import check_rules
from PIL import Image
from small_head import obj_text

from dermis import Human
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.export.targets import engine_files
from dermis.apps.export.targets.unity.project import asset_guid, guid_vector
from dermis.apps.export.targets.unity.target import Unity
from dermis.apps.export.targets.unreal.target import Unreal
from dermis.gpu import failures
from dermis.human.person_file import write_person_json
from dermis.images.colour import decode_srgb
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.maps import Maps

NAME = "person"


@pytest.fixture(scope="module")
def person(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    file = tmp_path_factory.mktemp("person") / f"{NAME}.json"
    write_person_json(file, Human.sampled(7))
    return load_subject(file, subdivide=1, glasses="round").with_painted_maps(256, "cpu")


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """Return a head from a file, without rig and maps, whose skin is not named "skin"."""
    file = tmp_path_factory.mktemp("scan") / "face.obj"
    file.write_text(obj_text().replace("usemtl skin", "usemtl face.002"))
    return load_subject(file)


@pytest.fixture(scope="module")
def unity(person: Subject, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unity") / "project"
    export_skin(person, "unity", folder, side=256, adapter="cpu")
    return folder


@pytest.fixture(scope="module")
def unreal(person: Subject, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unreal") / "files"
    export_skin(person, "unreal", folder, side=256, adapter="cpu")
    return folder


def read_yaml(file: Path) -> dict[str, Any]:
    """Return a Unity asset, whose tags are removed."""
    text = re.sub(r"!u!\d+ |%TAG.*", "", file.read_text("utf-8"))
    return next(iter(yaml.safe_load(text).values())) if file.suffix != ".meta" else yaml.safe_load(text)


def read_levels(file: Path) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(file.read_bytes()))) / 255.0


def test_unity_folder_is_a_project_with_all_references(unity: Path) -> None:
    assets = unity / "Assets" / NAME
    dependencies = json.loads((unity / "Packages/manifest.json").read_text("utf-8"))["dependencies"]
    assert {"com.unity.cloud.gltfast", "com.unity.render-pipelines.high-definition"} == set(dependencies)
    assert (
        (unity / "ProjectSettings/ProjectVersion.txt").read_text("utf-8").startswith("m_EditorVersion: 6000.")
    )
    guids = {read_yaml(meta)["guid"]: meta.with_suffix("") for meta in assets.glob("*.meta")}
    assert all(file.is_file() for file in guids.values())
    assert {file.suffix for file in guids.values()} == {".png", ".asset", ".mat"}
    material = read_yaml(assets / f"{NAME}_Skin.mat")
    slots = {key: value for one in material["m_SavedProperties"]["m_TexEnvs"] for key, value in one.items()}
    named = {slot: guids[value["m_Texture"]["guid"]].name for slot, value in slots.items()}
    assert named == {
        "_BaseColorMap": f"{NAME}_BaseMap.png",
        "_MaskMap": f"{NAME}_MaskMap.png",
        "_NormalMap": f"{NAME}_Normal.png",
    }
    assert "_MATERIAL_FEATURE_SUBSURFACE_SCATTERING" in material["m_ValidKeywords"]
    colours = {key: one for pair in material["m_SavedProperties"]["m_Colors"] for key, one in pair.items()}
    vector = np.array([colours["_DiffusionProfileAsset"][c] for c in "rgba"], "<f4")
    assert guids[vector.tobytes().hex()].name == f"{NAME}_DiffusionProfile.asset"
    assert read_yaml(assets / f"{NAME}_DiffusionProfile.asset")["profile"]["worldScale"] == 1


def test_guids_of_profiles_survive_as_decimal_numbers() -> None:
    for number in range(2000):
        guid = asset_guid(f"name {number}")
        vector = guid_vector(guid)
        assert len(guid) == 32 and np.isfinite(vector).all()
        assert np.array([f"{x:.9g}" for x in vector.tolist()], "<f4").tobytes().hex() == guid


def test_textures_of_unity_have_its_packing(unity: Path, person: Subject) -> None:
    assets = unity / "Assets" / NAME
    assert person.head is not None and person.head.maps.roughness is not None
    mask = read_levels(assets / f"{NAME}_MaskMap.png")
    roughness = np.sqrt(
        person.head.maps.roughness * person.skin.roughness / 0.3 * person.skin.roughness_factor
    )
    np.testing.assert_allclose(1.0 - mask[..., 3], np.clip(roughness, 0.0, 1.0), atol=0.004)
    assert (mask[..., 0] == 0.0).all() and (mask[..., 1] == 1.0).all()
    imports = {name: read_yaml(assets / f"{NAME}_{name}.png.meta")["TextureImporter"] for name in
               ("BaseMap", "MaskMap", "Normal")}  # fmt: skip
    assert [one["mipmaps"]["sRGBTexture"] for one in imports.values()] == [1, 0, 0]
    assert [one["textureType"] for one in imports.values()] == [0, 0, 1]  # 1 is a normal map


@pytest.mark.parametrize(("target", "start"), [("unity", f"Assets/{NAME}/{NAME}"), ("unreal", f"SK_{NAME}")])
def test_levels_of_detail_have_slots_and_morphs(target: str, start: str, unity: Path, unreal: Path) -> None:
    folder, counts = {"unity": unity, "unreal": unreal}[target], []
    for level in range(2):
        tree = check_rules(folder / f"{start}_LOD{level}.glb").tree
        meshes = {mesh["name"]: mesh for mesh in tree["meshes"]}
        assert {"head", "eye_left", "hair", "brows", "glasses_frame"} <= set(meshes)
        assert len(meshes["head"]["extras"]["targetNames"]) == 52
        attributes = [one["primitives"][0]["attributes"]["POSITION"] for one in meshes.values()]
        counts.append(sum(tree["accessors"][index]["count"] for index in attributes))
    assert counts[1] < 0.5 * counts[0]


def test_eyes_of_all_levels_are_painted_once_on_the_chosen_adapter(
    person: Subject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    adapters, paint, painted, given = list[str](), failures.run_on_device, list[object](), list[str]()
    monkeypatch.setattr(
        failures, "run_on_device", lambda adapter, job: (adapters.append(adapter), paint(adapter, job))[1]
    )
    monkeypatch.setattr(
        engine_files, "encode_glb", lambda subject, *_: (painted.append(subject.eye_pictures()), b"")[1]
    )
    assert person.scene is not None and person.head is not None and person.head.eyes is not None
    eyes = person.head.eyes.with_look(EyeLook(seed=5))  # not painted before
    scene = person.scene.replace(head=replace(person.head, eyes=eyes))
    assert len(list(engine_files.lod_files(replace(person, scene=scene, adapter="cpu"), NAME))) == 2
    assert adapters == ["cpu"] and painted[0] is painted[1]
    monkeypatch.setattr(Unity, "write", lambda _, subject, *rest: (given.append(subject.adapter), [])[1])
    export_skin(person, "unity", tmp_path / "project", adapter="cpu")
    assert given == ["cpu"]


def test_unreal_script_refers_to_the_written_files(unreal: Path, person: Subject) -> None:
    tree = ast.parse((unreal / f"{NAME}.py").read_text("utf-8"))
    values = {
        node.targets[0].id: node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
    }
    maps, meshes, slots = (ast.literal_eval(values[name]) for name in ("MAPS", "MESHES", "SKIN_SLOTS"))
    assert {name: is_colour for name, (_, is_colour) in maps.items()} == {
        "BaseColor": True, "Normal": False, "SRM": False
    }  # fmt: skip
    files = {file.name for file in unreal.iterdir()}
    assert {name for name, _ in maps.values()} | set(meshes) <= files and len(meshes) == 2
    assert {file for file in files if file.endswith((".png", ".glb"))} == {
        *(name for name, _ in maps.values()), *meshes
    }  # fmt: skip
    document = check_rules(unreal / meshes[0])
    assert set(slots) <= {material["name"] for material in document.tree["materials"]} and slots
    scalars = ast.literal_eval(values["SCALARS"])
    assert 0.08 * scalars["Specular"] == pytest.approx(
        0.4**2 / 2.4**2 * person.skin.specular_strength, rel=1e-4
    )
    packed = read_levels(unreal / maps["SRM"][0])
    assert (
        packed[..., 1].mean() == pytest.approx(scalars["Roughness"], abs=0.15) and (packed[..., 2] == 0).all()
    )


def test_unreal_script_connects_maps_and_sets_the_skin(unreal: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    editor = MagicMock()
    slots = [MagicMock(), MagicMock()]
    for slot, name in zip(slots, ("skin", "hair"), strict=True):
        slot.get_editor_property.return_value = name
    mesh_class = type("SkeletalMesh", (MagicMock,), {})
    mesh = mesh_class()
    mesh.get_editor_property.return_value = slots
    editor.SkeletalMesh, editor.StaticMesh = mesh_class, type("StaticMesh", (MagicMock,), {})
    editor.EditorAssetLibrary.does_asset_exist.return_value = False
    editor.EditorAssetLibrary.load_asset.side_effect = lambda path: mesh if path == "mesh" else MagicMock()
    editor.AssetImportTask.return_value.get_editor_property.return_value = ["mesh", "texture"]
    monkeypatch.setitem(sys.modules, "unreal", editor)
    runpy.run_path(str(unreal / f"{NAME}.py"))
    library, properties = editor.MaterialEditingLibrary, editor.MaterialProperty
    wired = [one.args[1:] for one in library.connect_material_property.call_args_list]
    assert sorted(wired, key=str) == sorted([
        ("R", properties.MP_SPECULAR), ("G", properties.MP_ROUGHNESS), ("", properties.MP_OPACITY),
        ("RGB", properties.MP_BASE_COLOR), ("RGB", properties.MP_NORMAL),
    ], key=str)  # fmt: skip
    made = editor.AssetToolsHelpers.get_asset_tools.return_value.create_asset
    assert [one.args[0] for one in made.call_args_list] == [NAME, f"M_{NAME}", f"MI_{NAME}"]
    set_on_skin, set_on_hair = (one.set_editor_property.call_args_list for one in slots)
    assert {one.args for one in set_on_skin} == {
        ("material_interface", made.return_value)
    } and not set_on_hair


def test_unreal_script_sets_the_skin_of_a_head_without_rig(
    scan: Subject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The editor imports such a head as a static mesh, and may replace spaces in names of slots."""
    export_skin(scan, "unreal", tmp_path / "files")
    editor, slots = MagicMock(), [MagicMock(), MagicMock()]
    for slot, name in zip(slots, ("face_002_skin", "hair"), strict=True):
        slot.get_editor_property.return_value = name
    classes = {name: type(name, (MagicMock,), {}) for name in ("SkeletalMesh", "StaticMesh")}
    mesh = classes["StaticMesh"]()
    mesh.get_editor_property.side_effect = {"static_materials": slots}.__getitem__
    editor.SkeletalMesh, editor.StaticMesh = classes.values()
    editor.EditorAssetLibrary.load_asset.side_effect = lambda path: mesh if path == "mesh" else MagicMock()
    editor.AssetImportTask.return_value.get_editor_property.return_value = ["mesh"]
    monkeypatch.setitem(sys.modules, "unreal", editor)
    runpy.run_path(str(tmp_path / "files" / f"{scan.identifier}.py"))
    assert [bool(slot.set_editor_property.call_args_list) for slot in slots] == [True, False]
    mesh.set_editor_property.assert_called_once_with("static_materials", slots)


def test_unity_colour_without_a_map_is_srgb(scan: Subject, tmp_path: Path) -> None:
    assert scan.scene is not None
    plain = replace(scan, scene=scan.scene.replace(head=replace(scan.scene.head, maps=Maps())))
    export_skin(plain, "unity", tmp_path / "project")
    material = read_yaml(next((tmp_path / "project").glob("Assets/*/*.mat")))
    colours = {key: one for pair in material["m_SavedProperties"]["m_Colors"] for key, one in pair.items()}
    written = [colours["_BaseColor"][channel] for channel in "rgb"]
    np.testing.assert_allclose(decode_srgb(written), scan.albedo, rtol=1e-4)


def test_single_files_stay_without_meshes(person: Subject, tmp_path: Path) -> None:
    files = export_skin(person, "unity", tmp_path / "skin.asset").files
    assert {file.suffix for file in files} == {".asset", ".png", ".md", ".json"}
    assert isinstance(TARGETS["unreal"], Unreal) and "single file" in TARGETS["unreal"].part_limitations
