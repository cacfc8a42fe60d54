"""Heads of people as .glb files: validity, and equality after reading them back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gltf_rules import check_rules, khronos_issues

from dermis import Human, Pose, load_head
from dermis.human.model import MATERIAL_OF_GROUP
from dermis.human.person_file import write_person_glb
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps

PERSON = Human.sampled(7)
SAME_MM = 0.02  # no eye sees it; displacements below a thousandth are left out
EXPRESSIONS = (Pose({"jawOpen": 1.0}), Pose({"mouthSmileLeft": 1.0, "eyeBlinkRight": 0.5}))
TURNS = (Pose(bones={"head": (0, 25, 0)}), Pose({"jawOpen": 0.5}, {"head": (15, 0, 10), "eye.L": (0, 20, 0)}))
FACE_MM = -60.0  # points above it, from the eyes, follow the head alone or the jaw and the eyes


def written(folder: Path, head: Head, **more: object) -> Path:
    write_person_glb(folder / "person.glb", PERSON, head, roughness=0.3, **more)  # type: ignore[arg-type]
    return folder / "person.glb"


def posed_mm(head: Head, pose: Pose) -> np.ndarray:
    """Return the vertices (v, 3) in a pose without lid contact, which files do not have."""
    rig = replace(head.control_rig, contact=None)
    return np.asarray(rig.posed_points_mm(pose.to_arrays(rig))[head.mesh.point])


def in_file(head: Head) -> np.ndarray:
    """Return the order (v,) of the vertices in the file, which is grouped by material."""
    used = np.unique(head.mesh.material)
    return np.concatenate([np.unique(head.mesh.triangles[head.mesh.material == one]) for one in used])


@pytest.mark.parametrize("layout", ["own", "hm08"])
@pytest.mark.parametrize("levels", [0, 1])
def test_files_keep_the_rules(tmp_path: Path, layout: str, levels: int) -> None:
    head = PERSON.head(layout=layout, subdivide=levels)  # type: ignore[arg-type]
    tree = check_rules(written(tmp_path, head)).tree
    assert tree["asset"]["generator"] == "dermis" and "CC0" in tree["asset"]["copyright"]
    assert tree["asset"]["extras"]["person"]["age"] == PERSON.age
    mesh = tree["meshes"][0]
    assert mesh["name"] == "head"
    assert mesh["extras"]["targetNames"] == list(head.targets) and "jawOpen" in head.targets
    names = [material["name"] for material in tree["materials"]]
    hairs = ["brows", "lashes", "hair"]
    assert names == [*[one.name for one in MATERIAL_OF_GROUP.values()][: len(names) - 3], *hairs]
    assert [load_head(tmp_path / "person.glb", eyes="plain").strands] == [None]  # hairs are not its mesh


def test_the_khronos_validator_finds_nothing(tmp_path: Path) -> None:
    found = khronos_issues(written(tmp_path, PERSON.head()))
    assert (found["numErrors"], found["numWarnings"]) == (0, 0), found["messages"]


def test_control_points_read_back_as_they_move(tmp_path: Path) -> None:
    head = PERSON.head(subdivide=0)
    back, order = load_head(written(tmp_path, head), eyes="plain", subdivide=0), in_file(head)
    for pose in (Pose(), *EXPRESSIONS, *TURNS):
        assert np.abs(posed_mm(back, pose) - posed_mm(head, pose)[order]).max() < SAME_MM


def test_finer_heads_read_back_as_they_move(tmp_path: Path) -> None:
    """Check expressions exactly, bones approximately: rotation and subdivision do not commute."""
    head = PERSON.head()
    back, order = load_head(written(tmp_path, head), eyes="plain", subdivide=0), in_file(head)
    for pose in (Pose(), *EXPRESSIONS):
        assert np.abs(posed_mm(back, pose) - posed_mm(head, pose)[order]).max() < SAME_MM
    for pose in TURNS:
        missed = np.linalg.norm(posed_mm(back, pose) - posed_mm(head, pose)[order], axis=1)
        face = (head.mesh.positions[order, 1] > FACE_MM) & (head.mesh.positions[order, 2] > 0)
        assert np.percentile(missed, 99) < 0.3 and missed.max() < 1.5
        assert np.percentile(missed[face], 99) < 0.1


def test_a_coarse_file_is_refined_as_the_person_is(tmp_path: Path) -> None:
    """Check Catmull-Clark subdivision with a sharp rim of the cut."""
    head, path = PERSON.head(), written(tmp_path, PERSON.head(subdivide=0))
    back = load_head(path, subdivide=1, eyes="plain")
    order = np.lexsort(np.round(head.mesh.uv, 6).T)
    again = np.lexsort(np.round(back.mesh.uv, 6).T)
    for pose in (*EXPRESSIONS, *TURNS):
        missed = posed_mm(back, pose)[again] - posed_mm(head, pose)[order]
        assert np.abs(missed).max() < SAME_MM


def test_an_expression_can_be_the_one_at_rest(tmp_path: Path) -> None:
    head = PERSON.head()
    path, order = written(tmp_path, head, expression_weights={"jawOpen": 0.4}), in_file(head)
    back = load_head(path, eyes="plain", subdivide=0)
    assert np.abs(back.mesh.positions - posed_mm(head, Pose({"jawOpen": 0.4}))[order]).max() < SAME_MM
    closed = posed_mm(back, Pose({"jawOpen": 0.0}))
    assert np.abs(closed - head.mesh.positions[order]).max() < SAME_MM


def test_maps_read_back_and_relief_is_shown_to_others(tmp_path: Path) -> None:
    side = 256
    rise = np.tile(np.linspace(0, 5, side, dtype=np.float32), (side, 1))
    brown = np.full((side, side, 3), (0.4, 0.25, 0.2), np.float32)
    maps = Maps(colour=brown, height=rise, roughness=np.full_like(rise, 0.36))
    head = PERSON.head(maps, subdivide=0)
    path = written(tmp_path, head)
    tree, found = check_rules(path).tree, load_head(path).maps
    assert "normalTexture" in tree["materials"][0] and "normalTexture" not in tree["materials"][1]
    assert found.height is not None and found.normal is None
    np.testing.assert_allclose(found.height, rise, atol=1e-4)
    assert found.roughness is not None and abs(float(found.roughness.mean()) - 0.36) < 0.003
    assert found.mean_colour is not None and maps.mean_colour is not None
    np.testing.assert_allclose(found.mean_colour, maps.mean_colour, atol=0.004)


def test_maps_of_other_shapes_have_no_normals_made(tmp_path: Path) -> None:
    maps = Maps(height=np.zeros((64, 128), np.float32))
    tree = check_rules(written(tmp_path, PERSON.head(maps, subdivide=0))).tree
    assert "normalTexture" not in tree["materials"][0]


def test_the_persons_own_eyes_stand_where_the_written_ones_are(tmp_path: Path) -> None:
    head = PERSON.head(subdivide=0)
    back = load_head(written(tmp_path, head), subdivide=0)
    assert head.eyes is not None and back.eyes is not None and back.bones == head.bones
    for pose in (Pose(), Pose(bones={"eye.L": (4.0, 12.0, 0.0), "head": (5.0, 10.0, 0.0)})):
        (own, found) = (
            one.eyes.eye_matrices(one.control_rig, pose.to_arrays(one.control_rig)) for one in (head, back)
        )
        places = np.linalg.inv(own)[:, :3, 3]
        np.testing.assert_allclose(np.linalg.inv(found)[:, :3, 3], places, atol=0.3)
        ways = [one[:, 2, :3] / np.linalg.norm(one[:, 2, :3], axis=1, keepdims=True) for one in (own, found)]
        np.testing.assert_allclose(ways[1], ways[0], atol=0.01)
