"""Each property of a file changes the loaded head, is named in a note, or refuses the file."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from egg import BUMPY, CLOTH, SKIN, Egg, Tree

from dermis.base.errors import DermisError
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.scene.heads import load_head

WITHOUT_MEANING = {
    "asset.generator": "names the program",
    "asset.copyright": "states rights",
    "extras": "of other programs, for themselves",
    "sampler.minFilter": "maps always have mip levels",
    "material.doubleSided": "surfaces are always drawn from both sides",
}
"""Properties that need no note, and why."""


class Loaded(NamedTuple):
    """Result of loading a file: digest of the head, notes, and the error."""

    digest: str
    notes: str
    error: str


def loaded(path: Path, unit_mm: float | None = None) -> Loaded:
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        try:
            head = load_head(path, subdivide=0, unit_mm=unit_mm)
        except DermisError as error:
            return Loaded("", "", str(error))
    return Loaded(digest_of(head), "\n".join(str(note.message) for note in notes), "")


def digest_of(head: Head) -> str:
    digest = hashlib.sha256(repr([astuple(one) for one in head.mesh.materials]).encode())
    arrays = [head.mesh.positions, head.mesh.normals, head.mesh.uv, head.mesh.triangles, head.mesh.material]
    arrays += [getattr(head.maps, one.name) for one in fields(Maps) if one.name != "parts"]
    parts = head.maps.parts
    arrays += [] if parts is None else [parts.colour, parts.surface, parts.emission]
    rig = head.rig
    arrays += [] if rig is None else [rig.positions_mm, rig.targets.delta_mm]
    for array in arrays:
        digest.update(b"none" if array is None else np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


Change = Callable[[Egg], None]


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


def sampler(**entry: int) -> Change:
    def change(egg: Egg) -> None:
        egg.tree["samplers"] = [entry]
        egg.tree["textures"][0]["sampler"] = 0

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
        values = np.random.default_rng(2).uniform(size=(egg.tree["accessors"][0]["count"], channels))
        egg.primitive(mesh)["attributes"]["COLOR_0"] = egg.file.numbers(values)

    return change


def wide_uv(egg: Egg) -> None:
    """Let the uv of the head run over two pictures, so that it matters how they continue."""
    transform("skin", scale=[1.5, 1.5])(egg)


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


BEFORE: dict[str, Change] = {"sampler.wrapS": wide_uv, "sampler.wrapT": wide_uv, "mesh.weights": targets}
BEFORE |= {f"{which}.normalTexture.scale": texture(which, "normalTexture") for which in ("skin", "cloth")}
BEFORE |= {"skin.emissive_strength": in_material("skin", {"emissiveFactor": [0.1, 0.1, 0.1]})}
BEFORE |= {"cloth.emissive_strength": in_material("cloth", {"emissiveFactor": [0.1, 0.1, 0.1]})}
BEFORE |= {"cloth.alphaCutoff": in_material("cloth", {"alphaMode": "MASK"})}
"""What a property needs to have a meaning."""

CHANGES: dict[str, Change] = {
    "sampler.wrapS": sampler(wrapS=33071),
    "sampler.wrapT": sampler(wrapT=33648),
    "sampler.magFilter": sampler(magFilter=9728),
    "sampler.minFilter": sampler(minFilter=9728),
    "asset.generator": lambda egg: egg.tree["asset"].update(generator="a program"),
    "asset.copyright": lambda egg: egg.tree["asset"].update(copyright="somebody"),
    "extras": lambda egg: egg.tree["nodes"][0].update(extras={"a": 1}),
    "node.translation": in_node(1, translation=[0.0, 0.1, 0.0]),
    "node.rotation": in_node(1, rotation=[0.0, 0.0, 0.6, 0.8]),
    "node.scale": in_node(1, scale=[1.1, 1.0, 1.0]),
    "node.matrix": in_node(1, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0.1, 0, 1]),
    "mesh.targets": targets,
    "mesh.weights": lambda egg: egg.tree["meshes"][0].update(weights=[0.5]),
    "primitive.material": lambda egg: egg.primitive(1).pop("material") and None,
    "primitive.indices": lambda egg: egg.primitive(1).pop("indices") and None,
    "primitive.normals": lambda egg: egg.primitive(0)["attributes"].pop("NORMAL") and None,
    "image": lambda egg: egg.tree["textures"][0].update(source=1),
    "vertex colours of skin": vertex_colours(0),
    "vertex colours of cloth": vertex_colours(1),
}
for _which in ("skin", "cloth"):
    CHANGES |= {
        f"{_which}.baseColorFactor": in_surface(_which, {"baseColorFactor": [0.5, 0.6, 0.7, 1.0]}),
        f"{_which}.metallicFactor": in_surface(_which, {"metallicFactor": 0.5}),
        f"{_which}.roughnessFactor": in_surface(_which, {"roughnessFactor": 0.3}),
        f"{_which}.metallicRoughnessTexture": gloss_texture(_which),
        f"{_which}.normalTexture": texture(_which, "normalTexture"),
        f"{_which}.normalTexture.scale": lambda egg, which=_which: getattr(egg, which)[  # type: ignore[misc]
            "normalTexture"
        ].update(scale=0.5),
        f"{_which}.occlusionTexture": texture(_which, "occlusionTexture"),
        f"{_which}.emissiveTexture": both(
            texture(_which, "emissiveTexture"), in_material(_which, {"emissiveFactor": [1, 1, 1]})
        ),
        f"{_which}.emissiveFactor": in_material(_which, {"emissiveFactor": [0.2, 0.0, 0.0]}),
        f"{_which}.emissive_strength": extension(
            _which, "KHR_materials_emissive_strength", {"emissiveStrength": 3.0}
        ),
        f"{_which}.alphaMode": in_material(_which, {"alphaMode": "MASK"}),
        f"{_which}.blend": in_material(_which, {"alphaMode": "BLEND"}),
        f"{_which}.texCoord": by_second_uv(_which),
        f"{_which}.transform.scale": transform(_which, scale=[2.0, 2.0]),
        f"{_which}.transform.offset": transform(_which, offset=[0.25, 0.0]),
        f"{_which}.transform.rotation": transform(_which, rotation=0.5),
        f"{_which}.unlit": extension(_which, "KHR_materials_unlit", {}),
        f"{_which}.glossiness": extension(
            _which, "KHR_materials_pbrSpecularGlossiness", {"diffuseFactor": [0.5, 0.4, 0.3, 1.0]}
        ),
    }
    for _name in ("clearcoat", "sheen", "specular", "ior", "transmission", "volume", "iridescence"):
        CHANGES[f"{_which}.{_name}"] = extension(_which, f"KHR_materials_{_name}", {})
    CHANGES[f"{_which}.unknown"] = extension(_which, "EXT_materials_unknown", {})
CHANGES["cloth.alphaCutoff"] = in_material("cloth", {"alphaCutoff": 0.2})


@pytest.mark.parametrize("name", CHANGES)
def test_a_property_is_drawn_noted_or_refused(name: str, tmp_path: Path) -> None:
    results = []
    for index, change in enumerate((nothing, CHANGES[name])):
        egg = Egg()
        BEFORE.get(name, nothing)(egg)
        change(egg)
        results.append(loaded(egg.write(tmp_path / f"{index}.glb")))
    before, after = results
    assert not before.error, before.error
    notes = [one.notes.replace("0.glb", "1.glb") for one in results]
    changed = after.error or after.digest != before.digest or notes[0] != notes[1]
    assert bool(changed) != (name in WITHOUT_MEANING), after


@pytest.mark.parametrize("which", ["skin", "cloth"])
def test_a_required_extension_that_is_not_read_refuses_the_file(which: str, tmp_path: Path) -> None:
    egg = Egg()
    extension(which, "EXT_materials_unknown", {})(egg)
    egg.tree["extensionsRequired"] = ["EXT_materials_unknown"]
    assert "EXT_materials_unknown" in loaded(egg.write(tmp_path / "a.glb")).error


def test_pictures_of_skin_and_cloth_are_not_exchanged(tmp_path: Path) -> None:
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


def load_quietly(path: Path, unit_mm: float = 1000.0) -> Head:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load_head(path, subdivide=0, unit_mm=unit_mm)


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
