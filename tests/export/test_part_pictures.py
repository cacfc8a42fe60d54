"""Exports of heads whose parts that are not skin have pictures."""

from __future__ import annotations

import base64
import gzip
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from egg import BUMPY, CLOTH, SIDE, Egg
from gltf_rules import check_rules, khronos_issues
from loaded_mesh import load_mesh
from numpy.typing import NDArray
from pbrt_grammar import read
from PIL import Image
from test_blender import export_in

from dermis.apps.export.registry import TARGETS
from dermis.apps.export.run import evaluate_export, export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.atlas.texture_baking import sample_points
from dermis.base.errors import DermisWarning
from dermis.formats.part_pictures import PartPictures
from dermis.images.colour import decode_srgb_levels
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps, PartMaps
from dermis.mesh.mesh import Material
from dermis.mesh.primitives import uv_sphere
from dermis.scene.heads import load_head

STEP = 0.5 / 255  # of a picture of 8 bits


def full_egg() -> Egg:
    """Return an egg whose collar has all pictures, and a hole in the first quarter of the first."""
    egg, opaque = Egg(), np.full((SIDE, SIDE), 255, np.uint8)
    opaque[: SIDE // 2, : SIDE // 2] = 40
    surface = egg.cloth["pbrMetallicRoughness"]
    surface |= {"baseColorTexture": egg.texture(np.dstack([CLOTH, opaque])), "metallicFactor": 0.7}
    surface["metallicRoughnessTexture"] = egg.texture(BUMPY)
    egg.cloth |= {"alphaMode": "MASK", "alphaCutoff": 0.3, "normalTexture": egg.texture(BUMPY)}
    egg.cloth |= {"emissiveTexture": egg.texture(CLOTH), "emissiveFactor": [1.0, 0.5, 0.0]}
    egg.cloth["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": 3.0}}
    egg.tree["extensionsUsed"] = ["KHR_materials_emissive_strength"]
    return egg


def load_quietly(path: Path) -> Head:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DermisWarning)
        return load_head(path, subdivide=0)


def load_subject_quietly(path: Path) -> Subject:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DermisWarning)
        return load_subject(path, profile="skin1", subdivide=0)


@pytest.fixture(scope="module")
def avatar(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return load_subject_quietly(full_egg().write(tmp_path_factory.mktemp("egg") / "egg.glb"))


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """Return an egg whose collar has only a picture of its colour."""
    return load_subject_quietly(Egg().write(tmp_path_factory.mktemp("egg") / "plain.glb"))


@pytest.fixture
def decoded_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Decode USD in this process, as the start of another takes half a second."""
    pytest.importorskip("pxr")
    from dermis.formats.usd import read as usd_read
    from dermis.formats.usd.decoder import decode

    (tmp_path / "copies").mkdir()
    monkeypatch.chdir(tmp_path / "copies")
    monkeypatch.setattr(usd_read, "run_decoder", lambda module, request, *others: decode(request))


def parts_of(subject: Subject) -> PartMaps:
    assert subject.head is not None and subject.head.maps.parts is not None
    return subject.head.maps.parts


def emission_strength(subject: Subject) -> float:
    emission = parts_of(subject).emission
    return 0.0 if emission is None else float(emission.max())


def cloth_texels(head: Head, values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the values of a map at the middles of the triangles of the collar."""
    mesh = head.mesh
    (cloth,) = [k for k, one in enumerate(mesh.materials) if one.has_maps]
    middle = mesh.uv[mesh.triangles[mesh.material == cloth]].mean(axis=1)
    x, y = (middle * values.shape[1::-1]).astype(int).T
    return values[y, x]


def check_equal_parts(subject: Subject, back: Head) -> None:
    """Compare the maps of the collar of a head with those of an exported file, to the rounding of 8 bits."""
    assert subject.head is not None and back.maps.parts is not None
    before, after = parts_of(subject), back.maps.parts
    colours, read_back = (
        cloth_texels(one, maps.colour) for one, maps in ((subject.head, before), (back, after))
    )
    np.testing.assert_allclose(read_back[:, :3], colours[:, :3], atol=STEP)
    np.testing.assert_array_equal(read_back[:, 3] >= 0.5, colours[:, 3] >= 0.5)
    assert {False, True} == set((colours[:, 3] >= 0.5).tolist())
    surface, own = cloth_texels(subject.head, before.surface), cloth_texels(back, after.surface)
    np.testing.assert_allclose(own[:, :2], surface[:, :2], atol=3 * STEP)
    np.testing.assert_allclose(own[:, 2:], surface[:, 2:], atol=1.01 * STEP)
    assert before.emission is not None and after.emission is not None
    emission, emitted = cloth_texels(subject.head, before.emission), cloth_texels(back, after.emission)
    np.testing.assert_allclose(emitted, emission, atol=2.3 * emission_strength(subject) * STEP)


def test_gltf_contains_the_pictures(avatar: Subject, tmp_path: Path) -> None:
    file = tmp_path / "out.glb"
    with warnings.catch_warnings():
        warnings.simplefilter("error", DermisWarning)
        export_skin(avatar, "gltf", file)
    tree = check_rules(file).tree
    (shirt,) = [one for one in tree["materials"] if one["name"] == "shirt"]
    assert (shirt["alphaMode"], shirt["alphaCutoff"], shirt["doubleSided"]) == ("MASK", 0.5, True)
    strength = emission_strength(avatar)
    assert strength > 1.5 and shirt["extensions"] == {
        "KHR_materials_emissive_strength": {"emissiveStrength": pytest.approx(strength)}
    }
    names = [one["name"] for one in tree["images"]]
    assert {"parts colour", "parts surface", "parts normal", "parts emission"} <= set(names)
    check_equal_parts(avatar, load_quietly(file))


def test_gltf_passes_the_khronos_validator(avatar: Subject, tmp_path: Path) -> None:
    export_skin(avatar, "gltf", tmp_path / "out.glb", variant="diffuse-transmission")
    assert khronos_issues(tmp_path / "out.glb")["numErrors"] == 0


def test_only_needed_pictures_are_written(plain: Subject, tmp_path: Path) -> None:
    export_skin(plain, "gltf", tmp_path / "out.glb")
    tree = check_rules(tmp_path / "out.glb").tree
    names = [one["name"] for one in tree["images"] if one["name"].startswith("parts")]
    (shirt,) = [one for one in tree["materials"] if one["name"] == "shirt"]
    assert sorted(names) == ["parts colour", "parts surface"] and "alphaMode" not in shirt
    assert shirt["pbrMetallicRoughness"]["metallicFactor"] == 0.0


def test_parts_without_roughness_use_the_default() -> None:
    mesh = uv_sphere(100.0, 8, 4)
    colour, surface = np.ones((4, 4, 4), np.float32), np.zeros((4, 4, 4), np.float32)
    pictures = PartPictures.from_head(Head("ball", mesh, Maps(parts=PartMaps(colour, surface))))
    assert pictures is not None
    assert pictures.needed_roles(Material("hat", "opaque", has_maps=True)) == {"colour"}
    assert pictures.needed_roles(Material("hat", "opaque", roughness=0.2)) == set()


@pytest.mark.parametrize("name", ["out.glb", "out.usda"])
def test_uniform_emission_needs_no_picture(name: str, tmp_path: Path, decoded_here: None) -> None:
    egg = Egg()
    egg.cloth |= {"emissiveFactor": [1.0, 0.5, 0.0]}
    egg.cloth["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": 3.0}}
    egg.tree["extensionsUsed"] = ["KHR_materials_emissive_strength"]
    subject = load_subject_quietly(egg.write(tmp_path / "egg.glb"))
    assert parts_of(subject).emission is None
    export_skin(subject, "usd" if name.endswith("a") else "gltf", tmp_path / name)
    assert not list(tmp_path.glob("*emission*"))
    (shirt,) = [one for one in load_quietly(tmp_path / name).mesh.materials if one.has_maps]
    assert shirt.emission == pytest.approx((3.0, 1.5, 0.0), rel=1e-5)


def test_blender_imports_a_head_with_pictures(avatar: Subject, tmp_path: Path) -> None:
    """Blender's importer builds a Principled BSDF with image nodes from the .glb beside the script."""
    export_skin(avatar, "blender", tmp_path / "scene")
    assert avatar.head is not None
    export = export_in((tmp_path / "scene" / "skin.py").read_text("utf-8"))
    (skin,) = [f"{one.name} skin" for one in avatar.head.mesh.materials if one.kind == "skin"]
    assert (export["head"], export["skin_materials"]) == ("head.glb", [skin])
    (shirt,) = [
        one
        for one in check_rules(tmp_path / "scene" / "head.glb").tree["materials"]
        if one["name"] == "shirt"
    ]
    assert {"baseColorTexture", "metallicRoughnessTexture"} <= set(shirt["pbrMetallicRoughness"])
    assert {"normalTexture", "emissiveTexture"} <= set(shirt)


@pytest.mark.parametrize("target", ["three", "babylon"])
def test_pages_contain_the_pictures(avatar: Subject, target: str, tmp_path: Path) -> None:
    export_skin(avatar, target, tmp_path / "page.html")
    encoded = re.search(r'id="head"[^>]*>([^<]+)<', (tmp_path / "page.html").read_text("utf-8"))
    assert encoded is not None
    (tmp_path / "page.glb").write_bytes(gzip.decompress(base64.b64decode(encoded[1])))
    check_equal_parts(avatar, load_quietly(tmp_path / "page.glb"))


@pytest.mark.parametrize("suffix", [".usda", ".usdz"])
def test_usd_is_read_back(avatar: Subject, suffix: str, tmp_path: Path, decoded_here: None) -> None:
    export_skin(avatar, "usd", tmp_path / f"out{suffix}")
    check_equal_parts(avatar, load_quietly(tmp_path / f"out{suffix}"))


def test_usd_has_openpbr_with_pictures(avatar: Subject, tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdShade

    export_skin(avatar, "usd", tmp_path / "out.usda")
    stage = Usd.Stage.Open(str(tmp_path / "out.usda"))
    material = UsdShade.Material(stage.GetPrimAtPath("/egg/materials/shirt"))
    surface = material.ComputeSurfaceSource("mtlx")[0]
    roles = {
        "base_color": "colour",
        "geometry_opacity": "opacity",
        "specular_roughness": "roughness",
        "base_metalness": "metalness",
        "emission_color": "emission",
    }
    for name, role in roles.items():
        image = UsdShade.Shader(surface.GetInput(name).GetConnectedSources()[0][0].source.GetPrim())
        file = image.GetInput("file").Get()
        assert Path(file.resolvedPath).name == f"out_parts_{role}.png"
    assert surface.GetInput("emission_luminance").Get() == pytest.approx(emission_strength(avatar))
    assert UsdGeom.Mesh(stage.GetPrimAtPath("/egg/mesh")).GetDoubleSidedAttr().Get()


@pytest.mark.parametrize("variant", ["open-pbr", "standard-surface"])
def test_materialx_is_valid(avatar: Subject, variant: str, tmp_path: Path) -> None:
    mx = pytest.importorskip("MaterialX")
    from dermis.apps.export.targets.openpbr.document import standard_library

    with pytest.warns(DermisWarning, match="uv of the meshes that exports to usd and gltf contain"):
        export_skin(avatar, "openpbr", tmp_path / "out.mtlx", variant=variant)
    document = mx.createDocument()
    mx.readFromXmlFile(document, str(tmp_path / "out.mtlx"))
    document.setDataLibrary(standard_library())
    assert document.validate() == (True, "")
    (node,) = [one for one in document.getNodes() if one.getName() == "shirt_surface"]
    for one in node.getInputs():
        assert node.getNodeDef().getActiveInput(one.getName()).getType() == one.getType()
    graph = document.getNodeGraph("shirt_maps")
    files = [one.getInput("file").getValueString() for one in graph.getNodes("image")]
    assert len(files) == 6 and all((tmp_path / file).is_file() for file in files)
    spaces = {one.getName(): one.getInput("file").getColorSpace() for one in graph.getNodes("image")}
    coloured = {name for name, space in spaces.items() if space == "srgb_texture"}
    assert coloured == {"parts_colour_image", "parts_emission_image"}


def picture(path: Path) -> Any:
    return np.asarray(Image.open(path))


def test_pictures_equal_the_maps(avatar: Subject, tmp_path: Path) -> None:
    """Colour is sRGB, and roughness is the width alpha of pbrt's distribution."""
    with pytest.warns(DermisWarning, match="do not emit light"):
        export_skin(avatar, "pbrt", tmp_path / "out.pbrt")
    maps = parts_of(avatar)
    colour = decode_srgb_levels(picture(tmp_path / "out_parts_colour.png"))
    np.testing.assert_allclose(colour, maps.colour[..., :3], atol=1.5 * STEP)
    alpha = picture(tmp_path / "out_parts_alpha.png") / 255
    np.testing.assert_allclose(alpha, maps.surface[..., 2] ** 2, atol=1.01 * STEP)
    np.testing.assert_allclose(
        picture(tmp_path / "out_parts_metalness.png") / 255, maps.surface[..., 3], atol=1.01 * STEP
    )
    np.testing.assert_array_equal(
        picture(tmp_path / "out_parts_opacity.png") == 255, maps.colour[..., 3] >= 0.5
    )
    assert set(np.unique(picture(tmp_path / "out_parts_opacity.png"))) == {0, 255}


def test_pbrt_has_textures_and_alpha(avatar: Subject, tmp_path: Path) -> None:
    with pytest.warns(DermisWarning):
        export_skin(avatar, "pbrt", tmp_path / "out.pbrt")
    found = read((tmp_path / "out.pbrt").read_text())
    named = {one.names[0]: one.parameters for one in found if one.word == "MakeNamedMaterial"}
    (mix,) = [one.parameters for one in found if one.names[-1:] == ["mix"]]
    assert [named[name]["type"] for name in mix["materials"]] == [["coateddiffuse"], ["conductor"]]
    textures = {one.names[0]: one.parameters for one in found if one.word == "Texture"}
    for one in (*textures.values(), *({"filename": own["normalmap"]} for own in named.values())):
        assert (tmp_path / one["filename"][0]).is_file()
    assert textures["parts_colour"]["encoding"] == ["sRGB"]
    assert {textures[f"parts_{role}"]["encoding"][0] for role in ("alpha", "metalness", "opacity")} == {
        "linear"
    }
    used = {name for own in named.values() for key in ("reflectance", "roughness") for name in own[key]}
    assert used == {"parts_colour", "parts_alpha"} and mix["amount"] == ["parts_metalness"]
    alphas = [one.parameters.get("alpha") for one in found if one.names == ["plymesh"]]
    assert sorted(map(str, alphas)) == ["None", "['parts_opacity']"]


def test_pbrt_without_metal_has_one_material(plain: Subject, tmp_path: Path) -> None:
    with pytest.warns(DermisWarning):
        export_skin(plain, "pbrt", tmp_path / "out.pbrt")
    found = read((tmp_path / "out.pbrt").read_text())
    (material,) = [one.parameters for one in found if one.names == ["coateddiffuse"]]
    assert material["reflectance"] == ["parts_colour"] and "normalmap" not in material
    assert not [one for one in found if one.word == "MakeNamedMaterial"]


def test_mitsuba_reads_the_pictures(avatar: Subject, tmp_path: Path) -> None:
    """The albedo that Mitsuba evaluates in each pixel is that of the map."""
    mi = pytest.importorskip("mitsuba")
    from dermis.apps.truths.mitsuba_scene import mitsuba_variant

    with pytest.warns(DermisWarning, match="do not emit light"):
        export_skin(avatar, "mitsuba", tmp_path / "out")
    mesh = load_mesh(tmp_path / "out" / "meshes" / "material_0.ply", unit_mm=1.0)
    assert len(mesh.triangles) == len(uv_sphere(1.0, 12, 8).triangles)
    colour = parts_of(avatar).colour
    with mitsuba_variant(mi, "scalar_rgb"):
        scene = mi.load_file(str(tmp_path / "out" / "scene.xml"), width="64", height="64", samples="1")
        buffers = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,uv:uv,shape:shape_index"})
        found = np.array(mi.render(scene, integrator=buffers, spp=1))
        lit = np.array(mi.render(scene, spp=1))
    albedo, uv, shape = found[..., :3], found[..., 3:5], found[..., 5]
    shown = shape == shape.max()
    expected = sample_points(colour, uv[shown], ("clamp", "clamp"))
    solid = expected[:, 3] > 0.8
    assert solid.sum() > 300
    np.testing.assert_allclose(albedo[shown][solid], expected[solid, :3], atol=0.02)
    np.testing.assert_allclose(albedo[shown][solid].mean(0), expected[solid, :3].mean(0), atol=0.002)
    assert np.isfinite(lit).all() and lit[shown].max() > 0.05


@pytest.mark.parametrize("target", ["unity", "unreal", "arnold", "renderman", "maps"])
def test_targets_without_parts_add_a_note(avatar: Subject, plain: Subject, target: str) -> None:
    own = TARGETS[target].with_variant(None)
    report = evaluate_export(avatar, own, own.versions[-1])
    assert report.limitations == f"{own.limitations} {own.part_limitations}"
    assert "Only skin is exported" in own.part_limitations
    bare = evaluate_export(load_subject("skin1"), own, own.versions[-1])
    assert bare.limitations == own.limitations
