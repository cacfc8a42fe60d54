"""Tests of clothing: geometry over the skin, rig, labels, colour bounce and words."""

from __future__ import annotations

import numpy as np
import pytest

import dermis
from dermis.base.errors import DermisError
from dermis.human.labels.classes import class_number
from dermis.human.labels.fields import mesh_labels
from dermis.human.person_file import read_person, write_person_json
from dermis.human.wear.fabrics import CLOTHS
from dermis.human.wear.garments import garment_panels
from dermis.human.wear.look import GARMENT_NAMES, Clothing
from dermis.human.wear.skin_sheet import RING_SIZE, levels_mm, ring_around, skin_sheet

BALD = dermis.HairLook("none")
PEOPLE = tuple(range(10))
POINT_STEP = 4  # one of this many points of a garment is tested
CANDIDATE_COUNT = 12  # triangles near a point of which one is the nearest


def dressed(garment: str, seed: int | None = None, **fields: object) -> dermis.Head:
    """Return the bald head of a person with a garment."""
    person = dermis.Human(hair=BALD) if seed is None else dermis.Human.sampled(seed, hair={"style": "none"})
    return dermis.Human(**{**vars(person), **fields, "clothing": garment}).head(subdivide=1, hairs=0.05)


def skin_depths_mm(head: dermis.Head, worn_mm: np.ndarray, skin_mm: np.ndarray) -> np.ndarray:
    """Return the signed distance of points from the triangles of the skin, positive below the skin [mm]."""
    from scipy.spatial import cKDTree
    from trimesh.triangles import closest_point

    body = head.body.mesh
    triangles = skin_mm[body.point[body.triangles[body.material == 0]]]
    middle = triangles.mean(axis=1)
    _, near = cKDTree(middle).query(worn_mm, k=CANDIDATE_COUNT)
    near = near.ravel()
    repeated = np.repeat(worn_mm, CANDIDATE_COUNT, axis=0)
    offset = repeated - closest_point(triangles[near], repeated)
    a, b, c = triangles[near].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    height = ((repeated - a) * normal).sum(axis=1) / np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    # of equally near triangles, which share an edge, the one that the point faces most decides the side
    distance = np.linalg.norm(offset, axis=1).reshape(-1, CANDIDATE_COUNT)
    rank = distance - 1e-3 * np.abs(height).reshape(-1, CANDIDATE_COUNT)
    best = np.arange(len(worn_mm)) * CANDIDATE_COUNT + rank.argmin(axis=1)
    return -np.sign(height[best]) * distance.ravel()[best]


def outer_points(garment: str) -> np.ndarray:
    """Return a mask of the points of a garment that are not the hem, which ends in the skin on purpose."""
    cloth = CLOTHS[Clothing(garment).cloth]
    return np.concatenate([panel.height_mm > 0.0 for panel in garment_panels(garment, cloth.folds)])


@pytest.mark.parametrize("garment", GARMENT_NAMES)
def test_no_garment_cuts_the_skin(garment: str) -> None:
    """The garments of ten people stay outside the skin, at rest and with a turned head, to 0.5 mm."""
    turned = dermis.Pose({"jawOpen": 0.4}, {"neck02": (0, 12, 0), "head": (0, 12, 0)})
    for seed in PEOPLE:
        head = dressed(garment, seed)
        outer, count = outer_points(garment), int(head.body.mesh.point.max()) + 1
        for pose in (dermis.Pose(), turned):
            points = head.control_rig.posed_points_mm(pose.to_arrays(head.control_rig))
            depth = skin_depths_mm(head, points[count:][outer][::POINT_STEP], points[:count])
            assert depth.max() < 0.5, (seed, pose)


def test_cloth_bridges_hollows_instead_of_following_the_skin() -> None:
    """Between collar bones and breast, taut cloth is farther from the skin than on the shoulders."""
    head = dressed("crew neck")
    count = int(head.body.mesh.point.max()) + 1
    points = head.mesh.points_mm
    depth = skin_depths_mm(head, points[count:], points[:count])
    assert np.percentile(-depth, 95) > 9.0
    assert np.median(-depth) < 8.0


def test_rings_lie_on_their_level_in_order() -> None:
    """The points of a ring have the level of the ring, and proceed around the neck once."""
    sheet = skin_sheet()
    ring = ring_around(sheet.level_mm - 12.0) @ sheet.mean_mm
    assert np.abs(levels_mm(ring) - 12.0).max() < 0.3
    angle = np.unwrap(np.arctan2(ring[:, 0], ring[:, 2] + 92.0))
    assert len(ring) == RING_SIZE
    assert np.all(np.diff(angle) > 0.0)
    assert angle[-1] - angle[0] < 2 * np.pi


def test_dressed_heads_keep_skin_landmarks_and_origin() -> None:
    """A garment changes neither the skin, nor the origin of the scene, nor the landmarks."""
    from dermis.human.landmarks.points import landmark_points

    bare, head = dermis.Human(hair=BALD).head(hairs=0.05), dressed("hoodie")
    count = len(bare.mesh.positions)
    np.testing.assert_array_equal(head.mesh.positions[:count], bare.mesh.positions)
    np.testing.assert_array_equal(head.body.mesh.uv, bare.mesh.uv)
    assert head.centre_mm == bare.centre_mm
    one, other = landmark_points(head, "ibug-68"), landmark_points(bare, "ibug-68")
    np.testing.assert_array_equal(one.point, other.point)
    np.testing.assert_array_equal(one.weight, other.weight)


def test_garments_have_a_label_of_their_own() -> None:
    """The triangles of a garment have the label "clothing", and those of the skin keep theirs."""
    bare, head = dermis.Human(hair=BALD).head(hairs=0.05), dressed("shirt")
    labels, plain = mesh_labels(head), mesh_labels(bare)
    count = len(bare.mesh.triangles)
    np.testing.assert_array_equal(labels.base[:count], plain.base)
    assert set(labels.base[count:].tolist()) == {class_number("clothing")}
    assert (labels.fields[len(bare.mesh.positions) :] < 0).all()


def test_garments_follow_the_bones() -> None:
    """The fold of a high collar turns with the neck, and the chest stays."""
    head = dressed("high neck")
    rig, count = head.control_rig, int(head.body.mesh.point.max()) + 1
    pose = dermis.Pose(bones={"neck01": (0, 20, 0), "neck03": (0, 20, 0)}).to_arrays(rig)
    moved = np.linalg.norm(rig.posed_points_mm(pose) - head.mesh.points_mm, axis=1)[count:]
    height = head.mesh.points_mm[count:, 1]
    assert moved[height > -120.0].max() > 8.0
    assert moved[height < -280.0].max() < 1.0


def test_people_share_the_template_of_a_garment() -> None:
    """Two people with the same garment and different colours share mesh data, and can exchange positions."""
    one, other = dressed("navy shirt", 3), dressed("white shirt", 4)
    assert one.topology_head is other.topology_head
    person = dermis.Human.sampled(4, hair={"style": "none"}, clothing="shirt")
    pose = dermis.Pose(positions_mm=person.positions_mm).to_arrays(one.control_rig)
    np.testing.assert_allclose(pose.positions_mm, other.control_rig.positions_mm, atol=2e-3)


@pytest.mark.parametrize(
    ("words", "item"),
    [
        ("navy denim shirt", Clothing("shirt", "denim", "navy")),
        ("shirt, denim, navy", Clothing("shirt", "denim", "navy")),
        ("high neck", Clothing("high neck", "wool", "navy")),
        ("#102030 v-neck", Clothing("v-neck", "cotton", "#102030")),
        ({"garment": "hoodie", "colour": "grey"}, Clothing("hoodie", "cotton", "grey")),
        ("none", None),
    ],
)
def test_words_describe_garments(words: object, item: Clothing | None) -> None:
    """Words in any order and mappings of fields become garments, and the text of a garment is parsed back."""
    found = dermis.Human(clothing=words).clothing
    assert found == item
    assert found is None or dermis.Human(clothing=found.text).clothing == found


@pytest.mark.parametrize(
    "words", ["tuxedo", "navy red shirt", {"garment": "shirt", "size": 3}, 7, "#12 shirt", ""]
)
def test_unknown_words_are_refused(words: object) -> None:
    """Words, fields and types that no garment has are refused with the known ones."""
    with pytest.raises(DermisError, match="clothing: expected"):
        dermis.Human(clothing=words)


def test_clothing_is_stored_with_the_person(tmp_path) -> None:
    """The garment of a person is written to JSON and read back; files without it give bare shoulders."""
    person = dermis.Human(clothing="beige linen shirt")
    write_person_json(tmp_path / "person.json", person)
    assert read_person(tmp_path / "person.json").clothing == person.clothing
    write_person_json(tmp_path / "bare.json", dermis.Human())
    assert read_person(tmp_path / "bare.json").clothing is None


def test_seeds_give_bare_people() -> None:
    """People by seed wear nothing unless clothing is given."""
    assert dermis.Human.sampled(7).clothing is None
    assert dermis.Human.sampled(7, clothing="olive hoodie").clothing == Clothing("hoodie", "cotton", "olive")


def test_clothing_of_a_mesh_file_is_refused(tmp_path) -> None:
    """Only parametric people can be dressed."""
    path = tmp_path / "ball.obj"
    path.write_text("v 0 0 0\nv 90 0 0\nv 0 90 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    with pytest.raises(DermisError, match="clothing: expected a person"):
        dermis.load_head(path, clothing="shirt", subdivide=0)
