"""Tests of glasses: fit to nose, brows and ears of each person, rigid motion, labels and words."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import dermis
from dermis.base.errors import DermisError
from dermis.formats.gltf.write import encode_head
from dermis.human.labels.classes import class_number
from dermis.human.labels.fields import mesh_labels
from dermis.human.wear.fabrics import linear_colour
from dermis.human.wear.glasses import glasses_solids
from dermis.human.wear.look import GLASSES_STYLES, Glasses
from dermis.mesh.maps import Maps

PEOPLE = tuple(range(6))
LEFT_EAR_TOP, RIGHT_EAR_TOP = 4597, 2176  # control points


def person(seed: int, **fields: object) -> dermis.Human:
    """Return a bald person."""
    return dermis.Human.sampled(seed, hair={"style": "none"}, **fields)


@cache
def front_depth(seed: int) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function from positions (n, 2) seen from the front to depths (n,) of the skin [mm]."""
    from scipy.interpolate import LinearNDInterpolator

    head = person(seed).head(subdivide=1, hairs=0.05)
    points, normals = head.mesh.positions, head.mesh.normals
    skin = np.unique(head.mesh.triangles[head.mesh.material == 0])
    skin = skin[(points[skin, 2] > -30.0) & (normals[skin, 2] > 0.1)]
    return LinearNDInterpolator(points[skin, :2], points[skin, 2])


@pytest.mark.parametrize("style", GLASSES_STYLES)
def test_rims_are_in_front_of_the_skin(style: str) -> None:
    """The front of a frame is not behind the skin of brows, nose and cheeks, seen from the front."""
    for seed in PEOPLE:
        parts = glasses_solids(style, person(seed).positions_mm.astype(np.float64))
        front = np.concatenate([parts[0].points, parts[-1].points])
        front = front[np.abs(front[:, 0]) < 50.0]
        assert np.nanmin(front[:, 2] - front_depth(seed)(front[:, :2])) > -0.5, seed


@pytest.mark.parametrize("style", ["square", "round"])
def test_temples_rest_on_the_ears(style: str) -> None:
    """The arms pass within 6 mm of the top of each ear, for heads of all sizes."""
    for seed in PEOPLE:
        control = person(seed).positions_mm.astype(np.float64)
        points = np.concatenate([one.points for one in glasses_solids(style, control) if one.slot == "frame"])
        for top in (LEFT_EAR_TOP, RIGHT_EAR_TOP):
            assert np.linalg.norm(points - control[top], axis=1).min() < 8.0, seed


def test_frames_follow_the_width_of_the_head() -> None:
    """The lenses of a wider head are wider, and the frame is symmetric on a symmetric head."""
    average, wide = (
        np.ptp(glasses_solids("square", one.positions_mm.astype(np.float64))[0].points[:, 0])
        for one in (dermis.Human(), dermis.Human(targets={"head/head-scale-horiz-incr": 1.0}))
    )
    assert wide > average + 0.5
    parts = glasses_solids("square", dermis.Human().positions_mm.astype(np.float64))
    points = np.concatenate([one.points for one in parts])
    assert abs(points[:, 0].max() + points[:, 0].min()) < 0.5


def test_glasses_turn_with_the_head_as_a_rigid_body() -> None:
    """Distances between points of glasses stay the same when the head turns and the jaw opens."""
    head = person(3, glasses="aviator").head(subdivide=1, hairs=0.05)
    rig, count = head.control_rig, int(head.body.mesh.point.max()) + 1
    pose = dermis.Pose({"jawOpen": 0.7}, {"head": (5, 20, 3)}).to_arrays(rig)
    before, after = head.mesh.points_mm[count:], rig.posed_points_mm(pose)[count:]
    assert np.linalg.norm(after - before, axis=1).max() > 5.0
    apart = [np.linalg.norm(points - points[0], axis=1) for points in (before, after)]
    np.testing.assert_allclose(*apart, atol=1e-2)


def test_glasses_have_a_label_and_combine_with_clothing() -> None:
    """Glasses and clothing of one person have their own labels and materials, in a fixed order."""
    head = person(5, glasses="brown sunglasses", clothing="shirt").head(subdivide=1, hairs=0.05)
    labels = mesh_labels(head)
    worn = labels.base[len(head.body.mesh.triangles) :]
    assert set(worn.tolist()) == {class_number("clothing"), class_number("glasses")}
    assert [one.label for one in head.mesh.materials if one.label] == ["clothing"] * 2 + ["glasses"] * 2


def test_metal_frames_are_metal() -> None:
    """Thin frames have the material of metal, and thick ones do not."""
    for style, metalness in (("round", 1.0), ("square", 0.0)):
        head = dermis.Human(hair=dermis.HairLook("none"), glasses=style).head(subdivide=0, hairs=0.05)
        frame = next(one for one in head.mesh.materials if one.name == "glasses frame")
        assert frame.metalness == metalness


def test_words_describe_glasses() -> None:
    """Words become glasses, a missing colour is the usual one, and unknown words are refused."""
    assert dermis.Human(glasses="round").glasses == Glasses("round", "gold")
    assert dermis.Human(glasses="red square").glasses == Glasses("square", "red")
    assert dermis.Human(glasses="none").glasses is None
    with pytest.raises(DermisError, match="glasses: expected"):
        dermis.Human(glasses="monocle")


def test_gltf_files_have_the_materials_of_what_is_worn() -> None:
    """Cloth, frame and lenses are materials of their own in glTF, with colour, roughness and metalness."""
    person = dermis.Human(hair=dermis.HairLook("none"), clothing="red shirt", glasses="aviator")
    head = replace(person.head(subdivide=0, hairs=0.05), maps=Maps(), eyes=None)
    data = encode_head(head, roughness=0.3)
    (length,) = struct.unpack("<I", data[12:16])
    surfaces = {
        one["name"]: one["pbrMetallicRoughness"] for one in json.loads(data[20 : 20 + length])["materials"]
    }
    assert surfaces["glasses frame"]["metallicFactor"] == 1.0
    assert surfaces["dark lens"]["roughnessFactor"] < 0.2
    assert surfaces["cloth"]["roughnessFactor"] > 0.8
    np.testing.assert_allclose(surfaces["cloth"]["baseColorFactor"][:3], linear_colour("red"), atol=1e-3)
