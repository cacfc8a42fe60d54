"""People of the parametric human: their fields, and valid heads."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dermis
from dermis import DermisError, Human, Pose
from dermis.atlas.build import build_atlas
from dermis.atlas.unwrap.flatten import singular_values
from dermis.human.makehuman import mesh_point_count
from dermis.human.model import MATERIAL_OF_GROUP
from dermis.human.skin import face
from dermis.human.skin.painted import PaintedMaps
from dermis.images.codecs import encode_png
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps

FACE_MM = 0.11  # a texel of a map of 4096 texels a side


@pytest.fixture(scope="module")
def head() -> Head:
    return Human().head(subdivide=0)


def test_shares_of_ancestry_sex_and_age_add_up() -> None:
    person = Human(african=0.2, asian=0.4, caucasian=0.2, sex=0.3, age=50)
    found = person.target_weights()
    assert sum(found.values()) == pytest.approx(1.0)
    old = (50 - 25) / 65
    assert found["macrodetails/asian-male-old"] == pytest.approx(0.5 * 0.3 * old)
    assert found["macrodetails/african-female-young"] == pytest.approx(0.25 * 0.7 * (1 - old))


def test_the_average_build_needs_no_target() -> None:
    assert not any("universal" in name for name in Human().target_weights())
    heavy = Human(age=25, weight=1.0).target_weights()
    assert heavy["macrodetails/universal-female-young-averagemuscle-maxweight"] == 1.0
    both = Human(age=25, weight=0.5, muscle=-0.5).target_weights()
    assert both["macrodetails/universal-female-young-minmuscle-maxweight"] == 0.25
    assert sum(weight for name, weight in both.items() if "universal" in name) == pytest.approx(0.75)


def test_people_between_two_lie_between_them() -> None:
    """Compare positions relative to the midpoint between the eyes."""
    young, middle, old = (Human(age=age).positions_mm for age in (25, 57.5, 90))
    off = np.abs(0.5 * (young + old) - middle)
    assert (off[: mesh_point_count()].max(axis=1) < 1e-3).mean() > 0.85
    assert off.max() < 0.15  # eyeballs stay round, and lids are drawn onto each person's own
    assert np.abs(old - young).max() > 3.0


def test_any_head_is_any_person_by_its_points(head: Head) -> None:
    person = Human(sex=1.0, age=70, targets={"nose/nose-hump-incr": 0.8})
    assert np.array_equal(person.head(subdivide=0).positions_mm, person.positions_mm)
    pose_arrays = Pose(positions_mm=person.positions_mm).to_arrays(head.control_rig)
    assert np.abs(head.control_rig.posed_points_mm(pose_arrays) - person.positions_mm).max() < 1e-3


def test_the_same_seed_is_the_same_person() -> None:
    assert Human.sampled(5) == Human.sampled(5) != Human.sampled(6)
    assert np.array_equal(Human.sampled(5).positions_mm, Human.sampled(5).positions_mm)


def test_a_thousand_people_are_adults_of_all_kinds() -> None:
    people = [Human.sampled(seed) for seed in range(1000)]
    ages = np.array([one.age for one in people])
    sexes = np.array([one.sex for one in people])
    assert 35 < ages.mean() < 60 and ages.std() > 10
    assert 0.4 < (sexes > 0.5).mean() < 0.6 and (np.abs(sexes - 0.5) >= 0.2).all()
    for name in ("african", "asian", "caucasian"):
        assert 0.25 < np.mean([getattr(one, name) for one in people]) < 0.42
    strengths = [weight for one in people for weight in one.targets.values()]
    assert min(strengths) >= 0.0 and max(strengths) < 0.8


@pytest.mark.parametrize("seed", range(12))
def test_faces_at_random_are_faces(seed: int) -> None:
    places = Human.sampled(seed).positions_mm
    assert np.isfinite(places).all()
    low, high = places.min(axis=0), places.max(axis=0)
    assert 75 < high[1] < 150 and 300 < high[0] - low[0] < 600  # crown over the eyes; upper arms


def test_the_layout_has_most_room_for_the_face(head: Head) -> None:
    mesh = head.mesh
    corners, uv = mesh.positions[mesh.triangles], mesh.uv[mesh.triangles]
    assert mesh.uv.min() >= 0.0 and mesh.uv.max() <= 1.0
    stretch = singular_values(corners, uv)
    skin = mesh.material == list(MATERIAL_OF_GROUP).index("body")
    assert (stretch[skin, 1] > 0).all()  # none is mirrored
    side_mm = 1.0 / np.sqrt(np.abs(stretch.prod(axis=1))) / 4096
    middle = corners.mean(axis=1)
    face = skin & (middle[:, 2] > 0) & (np.abs(middle[:, 1]) < 80)
    assert np.median(side_mm[face]) < FACE_MM
    assert np.median(side_mm[skin & (middle[:, 1] < -130)]) < 0.3


@pytest.mark.parametrize("layout", ["own", "hm08"])
def test_every_triangle_has_texels_of_its_own(layout: str) -> None:
    mesh = Human().head(layout=layout, subdivide=0).mesh  # type: ignore[arg-type]
    assert build_atlas(mesh, 1024, "stitched").unscattered_fraction(mesh) < (
        1e-3 if layout == "own" else 0.02
    )


def test_the_bust_is_closed(head: Head) -> None:
    """Check that the cap begins where the skin ends."""
    mesh = head.mesh
    cap = mesh.material == list(MATERIAL_OF_GROUP).index("cap")
    body = mesh.material == list(MATERIAL_OF_GROUP).index("body")
    edges = [_border(mesh.point[mesh.triangles[part]], head.positions_mm) for part in (cap, body)]
    assert len(edges[0]) > 100 and edges[0] == edges[1]


def _border(triangles: np.ndarray, places: np.ndarray) -> set[frozenset[tuple[float, ...]]]:
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    pairs, counts = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    ends = np.round(places[pairs[counts == 1]], 3).tolist()
    return {frozenset(map(tuple, pair)) for pair in ends}


def test_bones_move_what_they_should(head: Head) -> None:
    rest, rig = head.positions_mm, head.control_rig

    def moved(bone: str, degrees: tuple[float, float, float]) -> np.ndarray:
        pose_arrays = Pose(bones={bone: degrees}).to_arrays(rig)
        return np.linalg.norm(rig.posed_points_mm(pose_arrays) - rest, axis=1)

    skull = rest[:, 1] > 60
    chin = (rest[:, 1] < -85) & (rest[:, 2] > 10) & (rest[:, 1] > -110)
    jaw, turned = moved("jaw", (10, 0, 0)), moved("head", (0, 20, 0))
    assert jaw[chin].max() > 5 and jaw[skull].max() < 1e-3
    assert turned[skull].max() > 20 and turned[rest[:, 1] < -250].max() < 1e-3
    eye = moved("eye.L", (0, 20, 0)) > 1e-3
    assert eye.any() and (rest[eye, 0] > 5).all() and (np.abs(rest[eye, 1]) < 25).all()


def test_it_has_the_blend_shapes_of_arkit(head: Head) -> None:
    assert len(head.targets) == 52 and {"jawOpen", "eyeBlinkLeft", "mouthSmileRight"} <= set(head.targets)
    assert len(dermis.human_targets()) > 400 and not any("faceunits" in one for one in dermis.human_targets())


def test_it_is_loaded_by_name(head: Head) -> None:
    loaded = dermis.load_head("human")
    assert loaded.name == "human" and np.array_equal(loaded.positions_mm, head.positions_mm)
    assert len(loaded.mesh.triangles) == 4 * len(head.mesh.triangles)
    red, green, blue = loaded.maps.mean_colour
    assert red > green > blue
    with pytest.raises(DermisError, match="unit_mm: expected a mesh file"):
        dermis.load_head("human", unit_mm=10.0)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"age": 20}, "age: expected a number from 25 to 90, but got 20"),
        ({"sex": float("nan")}, "sex: expected a number"),
        ({"african": 0, "asian": 0, "caucasian": 0}, "ancestry: expected a weight"),
        ({"targets": {"nose/nose-hump-incr": 9.0}}, "expected a number from -2 to 2"),
    ],
)
def test_what_cannot_be_is_refused(fields: dict[str, object], message: str) -> None:
    with pytest.raises(DermisError, match=message):
        Human(**fields)  # type: ignore[arg-type]


def test_unknown_targets_and_seeds_are_refused() -> None:
    with pytest.raises(DermisError, match="Did you mean nose/nose-hump-incr"):
        Human(targets={"nose-hump-incr": 1.0}).head()
    with pytest.raises(DermisError, match="expected a published target"):
        _ = Human(targets={"wings": 1.0}).positions_mm
    with pytest.raises(DermisError, match="seed: expected a whole number"):
        Human.sampled(-1)
    with pytest.raises(DermisError, match=r"hair: expected a dictionary of the fields .* got a HairLook"):
        Human.sampled(1, hair=dermis.HairLook("bob"))


def test_maps_of_files_leave_the_others_painted(tmp_path: Path) -> None:
    path = tmp_path / "rough.png"
    path.write_bytes(encode_png(np.full((32, 32, 1), 64, np.uint8)))
    maps = dermis.load_head("human", roughness=path).maps
    assert isinstance(maps, PaintedMaps) and maps.colour is None
    assert maps.roughness is not None and np.allclose(maps.roughness, 64 / 255)


def test_a_look_is_put_on_painted_people_alone(head: Head) -> None:
    person = Human.sampled(5)
    dressed = person.transfer_skin_to(head)
    assert isinstance(dressed.maps, PaintedMaps) and dressed.maps.look == person.look
    assert dressed.mesh is head.mesh and dressed.eyes is not None and dressed.eyes.look == person.iris
    with pytest.raises(DermisError, match="painted skin"):
        person.transfer_skin_to(replace(head, maps=Maps()))


def test_levels_that_cannot_be_are_refused() -> None:
    with pytest.raises(DermisError, match="subdivide"):
        dermis.load_head("human", subdivide=-5)


def test_sizes_of_tables_are_theirs() -> None:
    folds = face.skin_folds()
    tables = {
        "zones": face.zone_table(),
        "folds": folds.curves,
        "knots": folds.knots,
        "edges": face.hairline_heights(),
    }
    assert face.paint_table_sizes() == {name: len(table) for name, table in tables.items()}
