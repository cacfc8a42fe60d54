"""Tests of headwear: fit over the skull, rigid motion, labels, words, and hair below it."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from test_clothing import skin_depths_mm

import dermis
from dermis.apps.export.hair_curves import curve_groups
from dermis.apps.validation.people.wear_penetration import wear_penetration
from dermis.base.errors import DermisError
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.formats.gltf.hair_ribbons import RibbonPrimitive
from dermis.human.labels.classes import class_number, label_classes
from dermis.human.labels.fields import mesh_labels
from dermis.human.person import outfit
from dermis.human.person_file import read_person, write_person_json
from dermis.human.wear.chances import sampled_items
from dermis.human.wear.headwear import STYLES, headwear_room, headwear_solids
from dermis.human.wear.look import HEADWEAR_STYLES, Headwear
from dermis.mesh.groom import HIDDEN_CEILING_MM
from dermis.mesh.grown_strands import grow_strands
from dermis.mesh.strand_groups import SCALP_HAIR, strand_groups
from dermis.scene.heads import dressed_name, load_person

PEOPLE = tuple(range(10))
POINT_STEP = 6  # one of this many points of headwear is tested


@cache
def bald_head(seed: int) -> dermis.Head:
    """Return the bald head of a person."""
    return dermis.Human.sampled(seed, hair={"style": "none", "beard_style": "none"}).head(hairs=0.05)


@cache
def long_haired(style: str) -> dermis.Head:
    """Return the head of a person with long hair and headwear; "none" for a bare head."""
    return dermis.Human(hair=dermis.HairLook("long"), headwear=style).head(hairs=0.05)


@pytest.mark.parametrize("style", HEADWEAR_STYLES)
def test_no_headwear_cuts_the_skin(style: str) -> None:
    """The headwear of ten people stays outside the skin, ears included, to 0.5 mm."""
    for seed in PEOPLE:
        head = bald_head(seed)
        control = head.control_rig.positions_mm.astype(np.float64)
        worn = np.concatenate([part.points for part in headwear_solids(style, control)])[::POINT_STEP]
        depth = skin_depths_mm(head, worn, head.mesh.points_mm)
        assert depth.max() < 0.5, seed


def test_headwear_turns_with_the_head_as_a_rigid_body() -> None:
    """Distances between points of a cap stay the same when the head turns and the brows rise."""
    head = long_haired("cap")
    rig, count = head.control_rig, int(head.body.mesh.point.max()) + 1
    pose = dermis.Pose({"browInnerUp": 1.0}, {"head": (5, 20, 3)}).to_arrays(rig)
    before, after = head.mesh.points_mm[count:], rig.posed_points_mm(pose)[count:]
    assert np.linalg.norm(after - before, axis=1).max() > 5.0
    apart = [np.linalg.norm(points - points[0], axis=1) for points in (before, after)]
    np.testing.assert_allclose(*apart, atol=1e-2)


def test_headwear_has_a_label_and_combines_with_other_items() -> None:
    """Clothing, glasses and headwear of one person have their own labels, in a fixed order."""
    person = dermis.Human(hair=dermis.HairLook("none"), glasses="round", clothing="shirt", headwear="cap")
    head = person.head(subdivide=0, hairs=0.05)
    worn = mesh_labels(head).base[len(head.body.mesh.triangles) :]
    labels = "clothing", "glasses", "headwear"
    assert set(worn.tolist()) == {class_number(one) for one in labels}
    assert label_classes()[class_number("headwear")].face_synthetics == 17
    names = [one.name for one in head.mesh.materials]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("style", ["cap", "headscarf"])
def test_hair_below_headwear_is_hidden_and_long_hair_comes_out(style: str) -> None:
    """Roots below a hat grow no visible strand above it, and long hair is visible below its rim."""
    head, bare = long_haired(style), long_haired("none")
    assert head.hair is not None and bare.hair is not None
    room = headwear_room(style, head.control_rig.positions_mm.astype(np.float64))
    found = []
    for one in (bare, head):
        strands = grow_strands(one.hair, one.mesh, one.mesh.points_mm, 800)
        knots = strands.knot_positions_mm(one.mesh, one.mesh.points_mm)[:, 1:].reshape(-1, 3)
        height, outside, inside = room.limits_mm(knots)
        visible = strands.radius_mm[:, 1:].ravel() > 0.0
        above = visible & (inside > 0.0) & (height > outside)
        found.append((above.mean(), (visible & (knots[:, 1] < -60.0)).mean()))
    (above_bare, low_bare), (above, low) = found
    assert above_bare > 0.05 and above < 0.002
    assert low > 0.8 * low_bare > 0.1


def test_exports_contain_only_visible_hair() -> None:
    """Hidden strands are left out, and long hair from below a cap is as wide as that of a bare head."""
    widths, counts = [], []
    for style in ("none", "cap"):
        head = long_haired(style)
        strands = strand_groups(head, 800)[SCALP_HAIR]
        assert (strands.radius_mm.max(axis=1) > 0.0).all()
        ribbons = RibbonPrimitive(DeformableMesh(head), strands, 10**6).vertices()[0]
        edges = ribbons.reshape(len(strands), -1, 3)[:, :-1].reshape(len(strands), -1, 2, 3)
        low = edges[..., 0, 1] < -60.0
        widths.append(float(np.median(np.linalg.norm(edges[:, :, 1] - edges[:, :, 0], axis=-1)[low])))
        counts.append(len(strands))
        assert all(np.isfinite(group.optical_depth).all() for group in curve_groups(head))
    assert widths[1] == pytest.approx(widths[0], rel=0.1) and widths[0] > 0.0
    assert counts[1] < counts[0]


def test_hair_of_bare_heads_has_no_ceiling() -> None:
    """Only guides below headwear are hidden; the guides of people with a bare head are shared."""
    person = dermis.Human(hair=dermis.HairLook("long"))
    assert long_haired("none").hair.guides is person.head(hairs=0.05).hair.guides  # type: ignore[union-attr]
    ceilings = long_haired("cap").hair.guides.ceilings_mm  # type: ignore[union-attr]
    assert 0.02 < (ceilings < HIDDEN_CEILING_MM).mean() < 0.9


@pytest.mark.parametrize("garment", ["crew neck", "hoodie"])
def test_hair_stays_out_of_clothing(garment: str) -> None:
    """Of the knots of long hair, fewer are inside cloth than without the obstacles."""
    for seed in (2,):
        person = dermis.Human.sampled(seed, hair={"style": "long"}, clothing=garment)
        found = wear_penetration(person, max_strands=400)
        assert found.hair_inside < 0.3 * found.hair_inside_before
        assert found.hair_inside < 0.015 * found.hair_knots


def test_words_describe_headwear(tmp_path) -> None:
    """Words become headwear, unknown words are refused, and files keep it; older files have none."""
    person = dermis.Human(headwear="olive denim cap")
    assert person.headwear == Headwear("cap", "denim", "olive")
    assert dermis.Human(headwear="turban").headwear == Headwear("turban", "linen", "charcoal")
    with pytest.raises(DermisError, match="headwear: expected"):
        dermis.Human(headwear="bowler")
    write_person_json(tmp_path / "person.json", person)
    assert read_person(tmp_path / "person.json").headwear == person.headwear
    parameters = json.loads((tmp_path / "person.json").read_text())
    del parameters["person"]["headwear"]
    (tmp_path / "older.json").write_text(json.dumps(parameters))
    assert read_person(tmp_path / "older.json").headwear is None


@pytest.mark.parametrize("seed", [7, 18])
def test_dressed_people_are_the_same_people(seed: int) -> None:
    """A dressed person of a seed differs from the bare one only in the worn items of that seed."""
    dressed, bare = load_person(f"human:{seed}?dressed"), load_person(f"human:{seed}")
    assert load_person(f"human:{seed}?bare") == bare
    assert replace(dressed, clothing=None, glasses=None, headwear=None) == bare
    assert dressed == load_person(f"human:{seed}?dressed")
    assert outfit(bare) == () and dressed.clothing is not None
    with pytest.raises(DermisError, match="bare or"):
        load_person(f"human:{seed}?naked")


def test_chances_follow_age_and_sex() -> None:
    """Older people wear glasses more often, men wear more caps, and one in eight people wears headwear."""
    many = range(1500)
    young, old = ([sampled_items(seed, 0.0, age) for seed in many] for age in (25.0, 70.0))
    men = [sampled_items(seed, 1.0, 25.0) for seed in many]
    with_glasses = [sum(one["glasses"] is not None for one in people) / 1500 for people in (young, old)]
    assert with_glasses == pytest.approx([0.28, 0.63], abs=0.04)
    assert sum(one["headwear"] is not None for one in men) / 1500 == pytest.approx(0.12, abs=0.025)
    caps = [
        sum(one["headwear"] == replace(one["headwear"], style="cap") for one in people if one["headwear"])
        for people in (young, men)
    ]
    assert caps[0] < caps[1]


def test_pictures_of_seeds_are_dressed_unless_the_name_says_bare() -> None:
    """The commands for pictures dress "human:7", and leave other names as they are."""
    names = "human:7", "human:7?bare", "human", "face.obj"
    assert [dressed_name(one) for one in names] == ["human:7?dressed", *names[1:]]


def test_portraits_show_the_whole_headwear() -> None:
    """A turban is in the frame with a margin, and bare heads keep the usual frame."""
    turban = dermis.Human(hair=dermis.HairLook("none"), headwear="turban").head(subdivide=0, hairs=0.05)
    top_mm = turban.mesh.positions[:, 1].max() - turban.centre_mm[1]
    camera, usual = dermis.portrait(turban), dermis.portrait(turban.body)
    assert usual == dermis.Camera(position=(0.0, -25.0, 1100.0), target=(0.0, -25.0, 0.0))
    assert usual.target[1] + 0.5 * usual.frame_mm < top_mm + 10.0 < camera.target[1] + 0.5 * camera.frame_mm
    bottom_mm = [one.target[1] - 0.5 * one.frame_mm for one in (usual, camera)]
    assert bottom_mm[0] == pytest.approx(bottom_mm[1])


def test_rims_are_symmetric_and_above_the_brows() -> None:
    """Headwear leaves the eyes free: its lowest point in front of the face is above them."""
    control = bald_head(0).control_rig.positions_mm.astype(np.float64)
    for style in STYLES:
        points = np.concatenate([part.points for part in headwear_solids(style, control)])
        assert points[points[:, 2] > 0.0, 1].min() > 14.0, style


def test_hair_swings_outside_clothing_and_inside_headwear() -> None:
    """Colliders of swinging hair are on clothing, not on the skin below it, and not on headwear."""
    from dermis.frame.features.hair.swing import collider_vertices

    person = dermis.Human(hair=dermis.HairLook("none"), clothing="crew neck", headwear="beanie")
    head = person.head(subdivide=1, hairs=0.05)
    mesh = head.mesh
    labels = ["clothing", "headwear", ""]
    on = {one: np.isin(np.array([m.label for m in mesh.materials])[mesh.material], one) for one in labels}
    vertices = {one: np.unique(mesh.triangles[mask]) for one, mask in on.items()}
    colliders = collider_vertices(head)
    assert np.isin(colliders, vertices["clothing"]).sum() > 1000
    assert not np.isin(colliders, vertices["headwear"]).any()
    skin = mesh.positions[colliders[np.isin(colliders, vertices[""])]]
    assert skin[:, 1].min() > -240.0
