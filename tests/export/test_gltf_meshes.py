"""Export to glTF: named meshes, hair on its bone, and materials for viewers of core glTF."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from gltf_rules import check_rules
from PIL import Image

from dermis import Human
from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.formats.gltf.document import Document
from dermis.formats.gltf.nodes import read_nodes
from dermis.human.hair.look import HairLook
from dermis.human.person_file import write_person_json
from dermis.mesh.maps import Maps

SIDE = 64


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """Return a person with a beard and few hairs, whose maps are plain arrays."""
    person = replace(Human.sampled(7), hair=HairLook("bob", beard_style="full", beard_mm=20.0))
    folder = tmp_path_factory.mktemp("person")
    write_person_json(folder / "person.json", person)
    loaded = load_subject(folder / "person.json", subdivide=1)
    rng = np.random.default_rng(5)
    maps = Maps(
        colour=np.full((SIDE, SIDE, 3), 0.25, np.float32),
        height=rng.uniform(0.0, 0.1, (SIDE, SIDE)).astype(np.float32),
        specular=rng.uniform(0.2, 1.0, (SIDE, SIDE)).astype(np.float32),
        roughness=np.full((SIDE, SIDE), 0.3, np.float32),
    )
    assert loaded.scene is not None and loaded.head is not None
    head = replace(person.head(hairs=0.1), name=loaded.head.name, maps=maps)
    assert loaded.person == person
    return replace(loaded, scene=replace(loaded.scene, head=head))


@pytest.fixture(scope="module")
def document(subject: Subject, tmp_path_factory: pytest.TempPathFactory) -> Document:
    file = tmp_path_factory.mktemp("glb") / "person.glb"
    export_skin(subject, "gltf", file, side=256)
    return check_rules(file)


def picture(document: Document, texture: dict[str, int]) -> np.ndarray:
    image = document.tree["images"][document.tree["textures"][texture["index"]]["source"]]
    return np.asarray(Image.open(io.BytesIO(document.read_view(image["bufferView"]))))


def test_parts_are_separate_named_meshes(document: Document) -> None:
    names = [mesh["name"] for mesh in document.tree["meshes"]]
    expected = {"head", "eye_left", "eye_right", "teeth_upper", "teeth_lower", "tongue", "brows", "lashes"}
    assert expected | {"beard", "hair"} <= {*names} and len(names) == len({*names})
    counts = {mesh["name"]: len(mesh.get("weights", [])) for mesh in document.tree["meshes"]}
    assert counts["head"] == 52 and counts["hair"] == 0
    assert all(5 < counts[name] < 52 for name in ("brows", "lashes", "beard"))


def test_hair_is_a_child_of_the_head_bone(document: Document, subject: Subject) -> None:
    """The transform of the node cancels that of the bone, so the hair lies where the head has it."""
    nodes, tree = read_nodes(document), document.tree
    (index,) = [k for k, node in enumerate(tree["nodes"]) if node["name"] == "hair"]
    assert nodes.names[nodes.parent[index]] == "head" and "skin" not in tree["nodes"][index]
    np.testing.assert_allclose(nodes.world[index], np.eye(4), atol=1e-6)
    (primitive,) = tree["meshes"][tree["nodes"][index]["mesh"]]["primitives"]
    places = 1e3 * document.read_floats(primitive["attributes"]["POSITION"])
    head = subject.head
    assert head is not None
    skull = head.mesh.positions[:, 1].max()
    assert skull - 5.0 < places[:, 1].max() < skull + 40.0 and len(places) > 10_000


def test_core_viewers_get_colour_roughness_and_normals(document: Document) -> None:
    (skin,) = [one for one in document.tree["materials"] if one["name"] == "skin"]
    surface = skin["pbrMetallicRoughness"]
    assert {"baseColorTexture", "metallicRoughnessTexture"} <= surface.keys() and "normalTexture" in skin
    assert "KHR_materials_transmission" not in skin["extensions"]  # rasterisers would show it black
    assert abs(int(picture(document, surface["baseColorTexture"])[0, 0, 0]) - 137) <= 1  # 0.25 in sRGB
    specular = picture(document, skin["extensions"]["KHR_materials_specular"]["specularTexture"])
    assert specular.shape[-1] == 2 and (specular[..., 0] == specular[..., 1]).all() and np.ptp(specular) > 100
    names = {image["name"] for image in document.tree["images"]}
    assert not names & {"height", "roughness", "region"}  # which no other program reads


def test_hair_shows_hairs_with_gaps_on_both_sides(document: Document) -> None:
    (hair,) = [one for one in document.tree["materials"] if one["name"] == "hair"]
    assert hair["alphaMode"] == "MASK" and hair["doubleSided"] is True
    alpha = picture(document, hair["pbrMetallicRoughness"]["baseColorTexture"])[..., 3]
    tile = alpha[:64]
    assert (
        0.5 < (tile[0] == 255).mean() < 0.8
        and (tile[-1] == 255).mean() < 0.1 * (tile[0] == 255).mean() + 0.05
    )


def test_small_changes_are_left_out(document: Document) -> None:
    """Displacements below 0.1 mm are missing; larger ones are as in a complete file."""
    (mesh,) = [one for one in document.tree["meshes"] if one["name"] == "head"]
    for target in mesh["primitives"][0]["targets"]:
        moved = 1e3 * np.abs(document.read_floats(target["POSITION"])).max(axis=1)
        assert (moved[moved > 0] > 0.0999).all()
