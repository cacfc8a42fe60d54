"""Eyes and hairs of a written person, as other programs draw them and as they are read back."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_rules import check_rules, khronos_issues

from dermis import DermisError, Human, Pose, load_head
from dermis.formats.gltf.document import Document
from dermis.formats.gltf.hair_tubes import FibreTubes
from dermis.frame.features.surface.painting.painted_head import paint_eye
from dermis.gpu import Device
from dermis.human.hair.look import HairLook
from dermis.human.person_file import write_person_glb
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import LIMBUS_MM, EyeTextures, eye_uv, surface_distance_mm

LOOK = EyeLook(eumelanin=0.1, pupil_mm=2.5, redness=0.0, seed=3)
PERSON = replace(Human.sampled(7), eyes=LOOK)
SIDE = 256


@pytest.fixture(scope="module")
def pictures(device: Device) -> EyeTextures:
    return paint_eye(device, LOOK, SIDE)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory, pictures: EyeTextures) -> Path:
    file = tmp_path_factory.mktemp("looks") / "person.glb"
    write_person_glb(file, PERSON, PERSON.head(subdivide=0), roughness=0.3, eyes=pictures)
    return file


def primitive(document: Document, name: str) -> dict[str, Any]:
    """Return the primitive with a material of that name."""
    names = [one["name"] for one in document.tree["materials"]]
    primitives = [p for mesh in document.tree["meshes"] for p in mesh["primitives"]]
    (found,) = [p for p in primitives if names[p["material"]] == name]
    return dict(found)


def texel(picture: np.ndarray, off_mm: float, turn: float) -> np.ndarray:
    """Return the texel of an eye's picture at a distance from the axis."""
    angle = np.linspace(0.0, 0.5 * np.pi, 2000)
    angle = np.interp(off_mm, surface_distance_mm(angle) * np.sin(angle), angle)
    place = surface_distance_mm(angle) * np.array(
        [np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)]
    )
    u, v = (eye_uv(place[None])[0] * len(picture)).astype(int)
    return np.asarray(picture[v, u])


def test_an_eye_is_painted_as_it_is_seen(pictures: EyeTextures) -> None:
    """Check a black pupil enlarged by the cornea, a blue iris, a white, and normals that focus light."""
    turns = np.linspace(0.0, 6.0, 12)
    rings = {
        off: np.array([texel(pictures.colour, off, t) for t in turns]).mean(axis=0)
        for off in (0.5, 2.4, 4.2, 9.0)
    }
    assert rings[0.5].max() < 0.01 and rings[2.4].max() < 0.01  # 2.5 mm are shown as 2.8
    assert 0.02 < rings[4.2].mean() < 0.5 * rings[9.0].mean() and rings[4.2][2] > rings[4.2][0]
    assert rings[9.0].min() > 0.35
    np.testing.assert_allclose(np.linalg.norm(pictures.normal, axis=-1), 1.0, atol=1e-5)
    right = texel(pictures.normal, 4.0, 0.0)
    assert right[0] < -0.3 and abs(right[1]) < 0.05  # the iris turns to the axis, the cornea from it


def test_eyes_have_their_pictures_and_a_coat(path: Path, pictures: EyeTextures) -> None:
    document = check_rules(path)
    for name in ("left eye", "right eye"):
        found = primitive(document, name)
        material = document.tree["materials"][found["material"]]
        assert "baseColorFactor" not in material["pbrMetallicRoughness"] and "normalTexture" in material
        coat = material["extensions"]["KHR_materials_clearcoat"]["clearcoatFactor"]
        assert coat * 0.04 == pytest.approx(((1.336 - 1) / (1.336 + 1)) ** 2, abs=5e-4)
        uv, places = (document.read_floats(found["attributes"][key]) for key in ("TEXCOORD_0", "POSITION"))
        front = places[np.hypot(*(uv - 0.5).T) < 0.21].max(axis=0) - places[
            np.hypot(*(uv - 0.5).T) < 0.21
        ].min(axis=0)
        assert front[0] * 1e3 == pytest.approx(
            2 * LIMBUS_MM, rel=0.15
        )  # the cornea has two fifths of the layout


def test_hairs_are_closed_tubes_of_the_hairs_width() -> None:
    head = PERSON.head(subdivide=0)
    assert head.strands is not None
    fibres = FibreTubes.from_strands(head.strands, head.mesh, 100_000, 5)
    places, normals = fibres.pose_vertices(head.mesh.points_mm)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)
    rings = places.reshape(len(head.strands), -1, 3)[:, :3]
    middle = head.strands.knot_positions_mm(head.mesh, head.mesh.points_mm)[:, 0]
    np.testing.assert_allclose(rings.mean(axis=1), middle, atol=1e-4)
    far = np.linalg.norm(rings - middle[:, None], axis=2)
    np.testing.assert_allclose(far, 1.2092 * head.strands.radius_mm[:, :1].repeat(3, axis=1), rtol=1e-3)
    edges = np.sort(fibres.triangles()[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert set(count) == {1, 2} and (count == 1).sum() == 3 * len(head.strands)  # open at the root alone
    few = FibreTubes.from_strands(head.strands, head.mesh, 100, 5)
    total = len(head.strands) * head.strands.radius_mm[:100, 0]
    np.testing.assert_allclose(100 * few.strands.radius_mm[:, 0], total, rtol=1e-5)
    own, wide = head.strands, few.strands
    through = own.absorption[:100] * own.radius_mm[:100, :1]
    np.testing.assert_allclose(wide.absorption * wide.radius_mm[:, :1], through, rtol=1e-5)  # of one colour


def test_hairs_are_as_light_as_their_pigment() -> None:
    def colour(look: HairLook) -> np.ndarray:
        head = Human(hair=look).head(subdivide=0)
        assert head.strands is not None
        return np.asarray(
            FibreTubes.from_strands(head.strands, head.mesh, 5000, 5).palette_and_uv()[0].mean(axis=(0, 1))
        )

    black, brown, blond = (colour(HairLook(eumelanin=e, pheomelanin=0.0)) for e in (8.0, 1.3, 0.3))
    assert black.max() < 0.01 < brown[0] < 0.05 < blond[0] < 0.3
    assert (np.diff(brown) < 0).all() and (np.diff(blond) < 0).all()


def test_lashes_go_along_with_a_lid(path: Path) -> None:
    """Check motion as in the package within 0.01 mm, except for lid contact."""
    head, document = PERSON.head(subdivide=0), check_rules(path)
    (mesh,) = [one for one in document.tree["meshes"] if one["name"] == "lashes"]
    (found,), names = mesh["primitives"], mesh["extras"]["targetNames"]
    moved = document.read_floats(found["targets"][names.index("eyeBlinkLeft")]["POSITION"]) * 1e3
    rest = document.read_floats(found["attributes"]["POSITION"]) * 1e3
    assert head.strands is not None and head.strands.is_lash is not None
    strands = head.strands.select(head.strands.is_lash)
    rig = head.control_rig
    points = rig.posed_points_mm(Pose({"eyeBlinkLeft": 1.0}).to_arrays(rig))
    before, after = (
        strands.knot_positions_mm(head.mesh, p)[:, -1] for p in (rig.posed_points_mm(rig.rest), points)
    )
    tip = np.arange(len(strands)) * 10 + 9
    np.testing.assert_allclose(rest[tip], before, atol=0.01)
    missed = np.linalg.norm(moved[tip] - (after - before), axis=1)
    assert np.linalg.norm(moved[tip], axis=1).max() > 5.0 and np.percentile(missed, 90) < 0.02
    assert (moved[tip][before[:, 0] < 0] == 0).all()  # none of the other eye's


def test_the_khronos_validator_finds_no_errors(path: Path) -> None:
    found = khronos_issues(path)
    codes = {one["code"] for one in found["messages"] if one["severity"] <= 1}
    assert found["numErrors"] == 0 and codes <= {"MESH_PRIMITIVE_GENERATED_TANGENT_SPACE"}


def test_the_same_person_is_read_back(path: Path) -> None:
    """Check that the eyes look the same and that hairs are not part of the mesh."""
    back = load_head(path)
    assert back.eyes is not None and back.eyes.look == LOOK
    assert len(load_head(path, eyes="plain", subdivide=0).mesh.triangles) == len(
        PERSON.head(subdivide=0).mesh.triangles
    )
    other = load_head(path, eye={"eumelanin": 0.9})
    assert other.eyes is not None and other.eyes.look == EyeLook(0.9, 2.5, 0.0, 3)


@pytest.mark.parametrize("eyes", [{"pupil_mm": 99}, {"eumelanin": "blue"}, {"seed": -1}, {"redness": None}])
def test_eyes_that_cannot_be_are_refused(path: Path, tmp_path: Path, eyes: dict[str, Any]) -> None:
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    tree = json.loads(data[20 : 20 + size])
    tree["asset"]["extras"]["person"]["eyes"] = eyes
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    spoilt = tmp_path / "spoilt.glb"
    head = struct.pack("<4sII", b"glTF", 2, len(data) - size + len(text)) + struct.pack(
        "<I4s", len(text), b"JSON"
    )
    spoilt.write_bytes(head + text + data[20 + size :])
    with pytest.raises(DermisError, match=r"spoilt\.glb"):
        load_head(spoilt)
