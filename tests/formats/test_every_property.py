"""Each property of a glTF file is treated as its reader declares."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import PIL.Image
import pytest
from egg import BUMPY, CLOTH, SKIN, Egg, Tree
from property_rows import load_quietly, loaded, names_of, row_named, treatment

from dermis.formats.gltf.read_materials import GLTF_MATERIAL_PROPERTIES
from dermis.formats.mesh_formats import MESH_FORMATS

PROPERTIES = MESH_FORMATS["gltf"].properties
Change = Callable[[Egg], object]


def in_material(which: str, entry: Tree) -> Change:
    return lambda egg: getattr(egg, which).update(entry)


def in_surface(which: str, entry: Tree) -> Change:
    return lambda egg: getattr(egg, which)["pbrMetallicRoughness"].update(entry)


def extension(which: str, name: str, entry: Tree) -> Change:
    def change(egg: Egg) -> None:
        getattr(egg, which).setdefault("extensions", {})[name] = entry
        egg.tree.setdefault("extensionsUsed", []).append(name)

    return change


def transform(which: str, **entry: Any) -> Change:
    def change(egg: Egg) -> None:
        reference = getattr(egg, which)["pbrMetallicRoughness"]["baseColorTexture"]
        reference["extensions"] = {"KHR_texture_transform": entry}

    return change


def texture(which: str, key: str, **more: Any) -> Change:
    return lambda egg: getattr(egg, which).update({key: egg.texture(BUMPY) | more})


def gloss_texture(which: str) -> Change:
    return lambda egg: getattr(egg, which)["pbrMetallicRoughness"].update(
        metallicRoughnessTexture=egg.texture(BUMPY)
    )


def sampler(which: str, **entry: int) -> Change:
    def change(egg: Egg) -> None:
        egg.tree["samplers"] = [entry]
        egg.tree["textures"][which == "cloth"]["sampler"] = 0

    return change


def second_uv(egg: Egg) -> None:
    for mesh in (0, 1):
        attributes = egg.primitive(mesh)["attributes"]
        uv = np.random.default_rng(mesh).uniform(size=(egg.tree["accessors"][0]["count"], 2))
        attributes["TEXCOORD_1"] = egg.file.numbers(uv)


def by_second_uv(which: str) -> Change:
    def change(egg: Egg) -> None:
        second_uv(egg)
        getattr(egg, which)["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 1

    return change


def vertex_colours(mesh: int, channels: int = 3) -> Change:
    def change(egg: Egg) -> None:
        values = np.random.default_rng(2).uniform(size=(egg.tree["accessors"][0]["count"], 4))
        egg.primitive(mesh)["attributes"]["COLOR_0"] = egg.file.numbers(values[:, :channels])

    return change


def wide_uv(which: str) -> Change:
    """Return a change that extends the uv beyond a picture, so that it matters how that continues."""
    return transform(which, scale=[1.5, 1.5])


def both(*changes: Change) -> Change:
    def change(egg: Egg) -> None:
        for one in changes:
            one(egg)

    return change


def nothing(egg: Egg) -> None:
    pass


def in_node(node: int, **entry: Any) -> Change:
    return lambda egg: egg.tree["nodes"][node].update(entry)


def targets(egg: Egg) -> None:
    count = egg.tree["accessors"][0]["count"]
    delta = np.zeros((count, 3))
    delta[:20, 2] = 0.01
    egg.primitive()["targets"] = [{"POSITION": egg.file.numbers(delta)}]


class Changed(NamedTuple):
    """Change of a file that exercises the row of which the name begins so.

    before : what the file needs so that the change has a meaning
    """

    row: str
    change: Change
    before: Change = nothing


def in_tree(**entry: Any) -> Change:
    return lambda egg: egg.tree.update(entry)


def fewer_triangles(egg: Egg) -> None:
    index = egg.tree["accessors"][egg.primitive(1)["indices"]]
    index["count"] -= 3


def strip(egg: Egg) -> None:
    egg.tree["meshes"][0]["primitives"].append(
        {**egg.primitive(), "mode": 5, "indices": egg.file.numbers(np.array([[0], [30], [60]]), "<u2")}
    )


def points(egg: Egg) -> None:
    egg.tree["meshes"][0]["primitives"].append({**egg.primitive(), "mode": 0})


def quantised(egg: Egg) -> None:
    uv = np.random.default_rng(3).integers(0, 65535, (egg.tree["accessors"][0]["count"], 2))
    egg.primitive()["attributes"]["TEXCOORD_0"] = egg.file.numbers(uv, "<u2", normalized=True)
    egg.tree |= {"extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"]}


def sparse_targets(egg: Egg) -> None:
    delta = np.zeros((egg.tree["accessors"][0]["count"], 3))
    delta[:20, 2] = 0.01
    egg.primitive()["targets"] = [{"POSITION": egg.file.sparse(delta)}]


def skinned(egg: Egg) -> None:
    count = egg.tree["accessors"][0]["count"]
    egg.primitive()["attributes"] |= {
        "JOINTS_0": egg.file.numbers(np.zeros((count, 4)), "<u1"),
        "WEIGHTS_0": egg.file.numbers(np.tile([1.0, 0, 0, 0], (count, 1))),
    }
    joint = egg.file.add("nodes", name="bone")
    egg.tree["nodes"][0]["skin"] = egg.file.add("skins", joints=[joint])


def used(name: str, **entry: Any) -> Change:
    return lambda egg: egg.tree.update({"extensionsUsed": [name], "extensions": {name: entry}})


def required(name: str) -> Change:
    return lambda egg: egg.tree.update({"extensionsUsed": [name], "extensionsRequired": [name]})


def without_data(egg: Egg) -> None:
    egg.tree["bufferViews"][0]["buffer"] = 1
    egg.file.more_buffers = [{"byteLength": 9}]


def expression(version: int, **more: Any) -> Change:
    """Return a change that adds an expression by the first target of the head."""
    bind = {"mesh": 0, "node": 0, "index": 0, "weight": 1.0}
    old = {"blendShapeMaster": {"blendShapeGroups": [{"name": "joy", "binds": [bind], **more}]}}
    new = {"expressions": {"preset": {"happy": {"morphTargetBinds": [bind], **more}}}}
    return both(targets, used("VRMC_vrm", **new) if version else used("VRM", **old))


CHANGES = [
    Changed("triangles, strips, fans", strip),
    Changed("points and lines", points),
    Changed("`indices`", fewer_triangles),
    Changed("`indices`", lambda egg: egg.primitive()["attributes"].pop("NORMAL")),
    Changed("`COLOR_0`", vertex_colours(0)),
    Changed("`COLOR_0`", vertex_colours(1)),
    Changed("alpha of `COLOR_0`", vertex_colours(0, 4), vertex_colours(0)),
    Changed("sparse accessors", quantised),
    Changed("sparse accessors", sparse_targets),
    *(Changed("`EXT_meshopt_compression`", required(f"{one}_meshopt_compression")) for one in ("EXT", "KHR")),
    Changed("other extensions that are required", required("ACME_shape")),
    Changed("other extensions that are used but not required", used("ACME_shape")),
    Changed("transforms of nodes", in_node(1, translation=[0.0, 0.1, 0.0])),
    Changed("transforms of nodes", in_node(1, rotation=[0.0, 0.0, 0.6, 0.8])),
    Changed("transforms of nodes", in_node(1, scale=[1.1, 1.0, 1.0])),
    Changed("transforms of nodes", in_node(1, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0.1, 0, 1])),
    Changed("morph targets", targets),
    Changed("morph targets", lambda egg: egg.tree["meshes"][0].update(weights=[0.5]), targets),
    Changed("morph targets", skinned),
    Changed("`KHR_lights_punctual`", in_node(1, extensions={"KHR_lights_punctual": {"light": 0}})),
    Changed("`KHR_lights_punctual`", in_node(1, camera=0)),
    Changed("several scenes", lambda egg: egg.file.more_scenes.append({"nodes": [1]})),
    Changed("buffers without data", without_data),
    Changed("names of materials", in_material("skin", {"name": "shirt skin"})),
    Changed("names of materials", lambda egg: egg.primitive(1).pop("material")),
    Changed("`asset`", lambda egg: egg.tree["asset"].update(generator="a program", copyright="somebody")),
    Changed("`asset`", in_node(0, extras={"a": 1}, name="a node")),
    Changed("`VRM`", used("VRM")),
    Changed("`VRMC_vrm`", used("VRMC_vrm")),
    Changed("expressions", expression(0), both(targets, used("VRM"))),
    Changed("expressions", expression(1), targets),
    Changed("changes of materials", expression(0, materialValues=[{"materialName": "a"}]), expression(0)),
    Changed("changes of materials", expression(1, materialColorBinds=[{"material": 0}]), expression(1)),
    Changed("MToon", used("VRM", materialProperties=[{"name": "a", "shader": "VRM/MToon"}]), used("VRM")),
    Changed("springs of hair", used("VRM", secondaryAnimation={}), used("VRM")),
    Changed(
        "constraints of bones",
        lambda egg: egg.tree["extensions"].update(VRMC_node_constraint={}),
        used("VRMC_vrm"),
    ),
    Changed("visibility in first", used("VRM", firstPerson={}), used("VRM")),
]
EXERCISED_ELSEWHERE = {
    "`KHR_draco_mesh_compression`": "test_draco.py, with the package DracoPy",
    "animations": "test_animation_curves.py and test_gltf_rig.py: they belong to motion, not to the head",
}


@pytest.mark.parametrize("case", CHANGES, ids=[one.row for one in CHANGES])
def test_a_property_is_treated_as_declared(case: Changed, tmp_path: Path) -> None:
    assert_treatment(case, row_named(PROPERTIES, case.row).treatment, tmp_path)


def assert_treatment(case: Changed, expected: str, folder: Path) -> None:
    results = []
    for change in (nothing, case.change):
        egg = Egg()
        case.before(egg)
        change(egg)
        results.append(loaded(egg.write(folder / "a.glb")))
    assert treatment(*results) == expected, results[1].notes + results[1].error


def material_changes(which: str) -> list[Changed]:
    """Return changes of the material of the skin or of the cloth."""
    glow = in_material(which, {"emissiveFactor": [0.1, 0.1, 0.1]})
    names = {"skin": {"name": "shirt"}, "cloth": {"name": "face"}}
    exchanged = both(*(in_material(one, entry) for one, entry in names.items()))
    scan = both(in_surface(which, {"baseColorFactor": [0, 0, 0, 1]}), popped_colour(which))
    mask, cutoff = ({"alphaMode": "MASK"} | more for more in ({}, {"alphaCutoff": 0.9}))
    gloss = {"diffuseFactor": [0.5, 0.4, 0.3, 1.0]}
    listed = {row.name: row.keys for row in GLTF_MATERIAL_PROPERTIES if row.keys and row.treatment == "noted"}
    del listed["`KHR_materials_emissive_strength`"]
    return [
        Changed("`baseColorFactor`", in_surface(which, {"baseColorFactor": [0.5, 0.6, 0.7, 1.0]})),
        Changed(
            "`baseColorFactor`",
            lambda egg: egg.tree["textures"][which == "cloth"].update(source=2),
            other_image,
        ),
        Changed("`normalTexture`", texture(which, "normalTexture")),
        Changed(
            "`normalTexture`", texture(which, "normalTexture", scale=0.5), texture(which, "normalTexture")
        ),
        Changed("`metallicRoughnessTexture`", gloss_texture(which)),
        Changed("`roughnessFactor`", in_surface(which, {"roughnessFactor": 0.3})),
        Changed("`metallicFactor`", in_surface(which, {"metallicFactor": 0.5})),
        Changed("`emissiveFactor`", glow),
        Changed("`emissiveFactor`", both(texture(which, "emissiveTexture"), glow)),
        Changed(
            "`KHR_materials_emissive_strength`",
            extension(which, "KHR_materials_emissive_strength", {"emissiveStrength": 3.0}),
            glow,
        ),
        Changed(
            "emission without",
            both(texture(which, "emissiveTexture"), in_material(which, {"emissiveFactor": [1, 1, 1]})),
            scan,
        ),
        Changed("`alphaMode`", in_material(which, mask)),
        Changed(
            "`alphaMode`", in_material(which, cutoff), in_material(which, mask if which == "cloth" else {})
        ),
        Changed("`alphaMode`", in_material(which, {"alphaMode": "BLEND"})),
        Changed("`occlusionTexture`", texture(which, "occlusionTexture")),
        Changed("`doubleSided`", in_material(which, {"doubleSided": True})),
        Changed("`texCoord`", by_second_uv(which), second_uv),
        Changed("`texCoord`", transform(which, scale=[2.0, 2.0])),
        Changed("`texCoord`", transform(which, offset=[0.25, 0.0])),
        Changed("`texCoord`", transform(which, rotation=0.5)),
        Changed("`wrapS`", sampler(which, wrapS=33071), wide_uv(which)),
        Changed("`wrapS`", sampler(which, wrapT=33648), wide_uv(which)),
        Changed("`magFilter`", sampler(which, magFilter=9728)),
        Changed("`minFilter`", sampler(which, minFilter=9728)),
        Changed("pictures in PNG", picture_in(which, "WEBP")),
        Changed("`KHR_texture_basisu`", only_ktx(which)),
        Changed(
            "`KHR_materials_volume_scatter`",
            extension(which, "KHR_materials_volume_scatter", {}),
            exchanged if which == "skin" else nothing,
        ),
        Changed(
            "`KHR_materials_pbrSpecularGlossiness`",
            extension(which, "KHR_materials_pbrSpecularGlossiness", {**gloss, "specularFactor": [1, 0, 0]}),
        ),
        *(Changed(row, extension(which, key, {})) for row, keys in listed.items() for key in keys),
        Changed("other extensions", extension(which, "EXT_materials_unknown", {})),
    ]


def other_image(egg: Egg) -> None:
    egg.texture(BUMPY)


def popped_colour(which: str) -> Change:
    return lambda egg: getattr(egg, which)["pbrMetallicRoughness"].pop("baseColorTexture")


def picture_in(which: str, kind: str) -> Change:
    def change(egg: Egg) -> None:
        file = BytesIO()
        PIL.Image.fromarray(BUMPY).save(file, kind)
        reference = egg.texture(file.getvalue())
        own = egg.tree["textures"][reference["index"]]
        own["extensions"] = {"EXT_texture_webp": {"source": own.pop("source")}}
        getattr(egg, which)["pbrMetallicRoughness"]["baseColorTexture"] = reference

    return change


def only_ktx(which: str) -> Change:
    def change(egg: Egg) -> None:
        own = egg.tree["textures"][which == "cloth"]
        own["extensions"] = {"KHR_texture_basisu": {"source": own.pop("source")}}

    return change


MATERIAL_CHANGES = [(which, case) for which in ("skin", "cloth") for case in material_changes(which)]


@pytest.mark.parametrize(
    ("which", "case"), MATERIAL_CHANGES, ids=[f"{which} {case.row}" for which, case in MATERIAL_CHANGES]
)
def test_a_property_of_a_material_is_treated_as_declared(which: str, case: Changed, tmp_path: Path) -> None:
    row = row_named(GLTF_MATERIAL_PROPERTIES, case.row)
    expected = row.treatment if which == "skin" else row.other_parts or row.treatment
    assert_treatment(case, expected, tmp_path)


def test_all_table_rows_are_exercised() -> None:
    rows = {row_named(PROPERTIES, one.row).name for one in CHANGES}
    assert rows | EXERCISED_ELSEWHERE.keys() == names_of(PROPERTIES)
    assert {row_named(GLTF_MATERIAL_PROPERTIES, one.row).name for _, one in MATERIAL_CHANGES} == names_of(
        GLTF_MATERIAL_PROPERTIES
    )


def test_pictures_of_skin_and_cloth_are_not_swapped(tmp_path: Path) -> None:
    head = load_quietly(Egg().write(tmp_path / "a.glb"))
    kinds = {one.name: one.kind for one in head.mesh.materials}
    assert kinds == {"face": "skin", "shirt": "opaque"}
    assert head.maps.colour is not None and head.maps.parts is not None
    assert head.maps.colour.shape == (*SKIN.shape[:2], 3)
    for map_, picture, kind in ((head.maps.colour, SKIN, "skin"), (head.maps.parts.colour, CLOTH, "opaque")):
        own = np.array([one.kind == kind for one in head.mesh.materials])[head.mesh.material]
        middle = head.mesh.uv[head.mesh.triangles[own]].mean(axis=1)
        y, x = (np.clip(middle[:, ::-1] * map_.shape[:2], 0, np.array(map_.shape[:2]) - 1)).astype(int).T
        colours = {
            tuple(colour) for colour in np.rint(255 * np.clip(map_[y, x, :3], 0, 1) ** (1 / 2.2)).astype(int)
        }
        near = [min(np.abs(np.array(one) - picture.reshape(-1, 3)).max(axis=1)) for one in colours]
        assert np.mean(np.array(near) < 12) > 0.6


def test_skin_without_uv_gets_a_layout_that_takes_its_vertex_colours(tmp_path: Path) -> None:
    egg = Egg()
    vertex_colours(0)(egg)
    del egg.primitive()["attributes"]["TEXCOORD_0"]
    del egg.skin["pbrMetallicRoughness"]["baseColorTexture"]
    egg.skin["pbrMetallicRoughness"]["baseColorFactor"] = [1.0, 1.0, 1.0, 1.0]
    path = egg.write(tmp_path / "a.glb")
    assert "has no uv" in loaded(path).notes
    head = load_quietly(path)
    used = np.unique(head.mesh.triangles[[head.mesh.materials[k].kind == "skin" for k in head.mesh.material]])
    assert head.maps.colour is not None and np.ptp(head.mesh.uv[used], axis=0).min() > 0.5
    assert head.maps.colour.std() > 0.1
