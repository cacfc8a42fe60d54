"""Regions of the face: labels by landmarks, tables, blurred maps."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from dermis.atlas.build import build_atlas
from dermis.base.errors import DermisError
from dermis.cli.scene_options import SceneOptions, assemble_scene
from dermis.human.person import Human
from dermis.human.regions import apply
from dermis.human.regions.apply import gaussian_mean, with_default_regions, with_regions
from dermis.human.regions.average import (
    AVERAGE_HUMAN,
    average_head,
    average_skin,
    classify_surface,
    landmark_indices,
    quads_of_parts,
)
from dermis.human.regions.labels import average_landmarks, known_landmarks, label_texels, warp_to_average
from dermis.human.regions.region_table import REGIONS, RegionTable, load_region_table
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.scene.heads import load_head

SCAN = "lee_perry_smith"
MAKEHUMAN = ("head_old_male_dark", "head_young_male_light")
# What lies at a landmark; borders are picked to a millimetre or two, so both sides of one are right.
PLAUSIBLE = {
    "vertex": {"neck and scalp"},
    "opisthocranion": {"neck and scalp"},
    "nose tip": {"nose"},
    "nose wing": {"nose"},
    "subnasale": {"nose", "upper lip"},
    "upper lip": {"upper lip", "lips"},
    "stomion": {"lips"},
    "lower lip": {"lips", "chin"},
    "pogonion": {"chin"},
    "mouth corner": {"lips", "cheek", "chin", "upper lip"},
    "inner eye corner": {"eyelid"},
    "outer eye corner": {"eyelid"},
    "brow": {"brow"},
    "glabella": {"forehead"},
    "tragus": {"ear", "cheek"},
    "ear top": {"ear"},
    "ear back": {"ear"},
    "ear lobe": {"ear"},
}


@lru_cache(maxsize=4)
def _head(name: str, folder: Path) -> Head:
    if name in MAKEHUMAN:
        return load_head(folder / "heads" / "makehuman" / f"{name}.obj", unit_mm=100)
    return load_head(name)


def _areas(head: Head, table: RegionTable, size: int = 512) -> np.ndarray:
    """Return the area by region on the right and on the left side (2, 10) [mm2]."""
    atlas = build_atlas(head.mesh, size)
    labels = label_texels(head, atlas, table)
    points = atlas.interpolate(head.mesh, head.mesh.positions)[atlas.coverage]
    owner = atlas.triangle[atlas.coverage]
    a, b, c = head.mesh.positions[head.mesh.triangles].astype(float).transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    share = area[owner] / np.bincount(owner, minlength=len(area))[owner]
    side = points[:, 0] > head.centre_mm[0]
    return np.array([np.bincount(labels[side == s], share[side == s], len(REGIONS)) for s in (False, True)])


@pytest.mark.parametrize("name", [SCAN, *MAKEHUMAN])
def test_landmarks_lie_in_their_regions(name: str, sample_folder: Path) -> None:
    head = _head(name, sample_folder)
    places = known_landmarks(head)
    assert places is not None
    points = np.array(list(places.values())) + np.array(head.centre_mm)
    carried = warp_to_average(head, places, points)
    labels = classify_surface(carried, average_skin().nearest_quads(carried))
    found = {place: REGIONS[label] for place, label in zip(places, labels, strict=True)}
    wrong = {
        place: region
        for place, region in found.items()
        if region not in PLAUSIBLE.get(re.sub("^(left|right) ", "", place), REGIONS)
    }
    assert not wrong


@pytest.mark.parametrize("name", [SCAN, *MAKEHUMAN])
def test_all_regions_are_there_on_both_sides_alike(name: str, sample_folder: Path) -> None:
    right, left = _areas(_head(name, sample_folder), load_region_table("default"))
    assert (np.minimum(left, right) > 50).all(), dict(zip(REGIONS, left, strict=True))
    np.testing.assert_allclose(left, right, rtol=0.25)


def test_the_average_human_is_carried_onto_itself() -> None:
    places = average_landmarks()
    points = np.array(list(places.values()))
    mesh = _quad()
    object.__setattr__(mesh, "positions", points.astype(np.float32))
    head = Head("the average", mesh, Maps())
    shifted = {name: tuple(np.array(place) - head.centre_mm) for name, place in places.items()}
    np.testing.assert_allclose(warp_to_average(head, shifted, points), points, atol=0.01)


def test_landmarks_of_the_human_are_pairs_in_their_places() -> None:
    places = {name: np.array(place) for name, place in average_landmarks().items()}
    for name, place in places.items():
        side, _, of = name.partition(" ")
        if side == "left":
            assert place[0] > 5
            np.testing.assert_allclose(places[f"right {of}"], place * (-1, 1, 1), atol=0.01)
        elif side != "right":
            assert abs(place[0]) < 0.01
    height = [name for name in places if not name.startswith("right")]
    height.sort(key=lambda name: -places[name][1])
    down = "vertex, glabella, nasion, nose tip, subnasale, upper lip, stomion, lower lip, pogonion, gnathion"
    assert [name for name in height if name in down.split(", ")] == down.split(", ")
    front = max(places, key=lambda name: float(places[name][2]))
    assert front == "nose tip"
    depth = [places[f"left {name}"][2] for name in ("inner eye corner", "outer eye corner", "tragus")]
    assert depth == sorted(depth, reverse=True)
    back = min(places, key=lambda name: float(places[name][2]))
    assert back == "opisthocranion"


def test_landmarks_of_the_human_lie_on_its_outer_skin() -> None:
    mesh = average_head().mesh
    seen = np.flatnonzero(mesh.material == 0)
    outer = seen[~np.isin(seen // 2, quads_of_parts()["mouth"])]
    assert set(landmark_indices().values()) <= set(mesh.point[mesh.triangles[outer]].ravel().tolist())


@pytest.mark.parametrize(
    ("person", "unlike"), [(AVERAGE_HUMAN, 0.05), (Human(sex=1, age=80), 0.05), (Human.sampled(4), 0.25)]
)
def test_people_have_all_regions_on_both_sides(person: Human, unlike: float) -> None:
    right, left = _areas(person.head(), load_region_table("default"), 1024)
    assert (np.minimum(left, right) > 300).all(), dict(zip(REGIONS, left, strict=True))
    np.testing.assert_allclose(left, right, rtol=unlike)


def test_a_place_of_the_human_has_one_region_in_all_its_meshes() -> None:
    """Compare the regions of landmarks between layouts, levels of subdivision and people."""
    wanted = _at_landmarks(AVERAGE_HUMAN.head(), 512)
    wrong = {
        place: region
        for place, region in wanted.items()
        if region not in PLAUSIBLE.get(re.sub("^(left|right) ", "", place), REGIONS)
    }
    assert not wrong
    person = Human(asian=1, african=0, caucasian=0, sex=0, age=30)
    heads = [AVERAGE_HUMAN.head(layout="hm08"), AVERAGE_HUMAN.head(subdivide=0), person.head(subdivide=2)]
    for head in heads:
        found = _at_landmarks(head, 512)
        same = [found[place] == region for place, region in wanted.items()]
        assert np.mean(same) > 0.8  # those on a border may fall to either side


def _at_landmarks(head: Head, size: int) -> dict[str, str]:
    """Return the region of the texel nearest to each landmark on the skin."""
    from scipy.spatial import cKDTree

    atlas = build_atlas(head.mesh, size)
    labels = label_texels(head, atlas, load_region_table("default"))
    points = atlas.interpolate(head.mesh, head.mesh.positions)[atlas.coverage] - np.array(head.centre_mm)
    places = known_landmarks(head)
    assert places is not None
    nearest = cKDTree(points).query(np.array(list(places.values())))[1]
    return {place: REGIONS[label] for place, label in zip(places, labels[nearest], strict=True)}


@pytest.mark.samples
def test_parts_are_what_the_tool_finds(sample_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "tools"))
    import human_parts

    found = human_parts.parts(sample_folder / "heads" / "human" / "masks")
    assert found.keys() == quads_of_parts().keys()
    for name, quads in found.items():
        np.testing.assert_array_equal(quads_of_parts()[name], quads)


def test_a_head_with_labels_keeps_them() -> None:
    region = np.array([[3, 3], [6, 9]], np.uint8).repeat(32, axis=0).repeat(32, axis=1)
    head = Head("card", _quad(), Maps(region=region))
    atlas = build_atlas(head.mesh, 64)
    labels = label_texels(head, atlas, load_region_table("default"))
    np.testing.assert_array_equal(labels, region[atlas.coverage])


def test_labels_beyond_the_list_and_heads_without_labels_are_refused() -> None:
    atlas = build_atlas(_quad(), 64)
    with pytest.raises(DermisError, match="labels from 0 to 9"):
        label_texels(
            Head("card", _quad(), Maps(region=np.full((8, 8), 10, np.uint8))), atlas, _table(0.3, 0.2)
        )
    with pytest.raises(DermisError, match="it has no labels"):
        label_texels(Head("card", _quad(), Maps()), atlas, _table(0.3, 0.2))


def test_landmarks_of_another_head_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "marks.csv"
    head, atlas = Head("card", _quad(), Maps()), build_atlas(_quad(), 64)
    table = RegionTable(_table(0.3, 0.2).values, landmarks=file)
    rows = [f"{name},500,0,0" for name in average_landmarks()]
    corners = np.resize(head.mesh.positions - head.centre_mm, (len(rows), 3))
    flat = [f"{name},{x},{y},{z}" for name, (x, y, z) in zip(average_landmarks(), corners, strict=True)]
    for text, message in (
        ("\n".join(flat), "they lie in one plane"),
        ("\n".join(rows), "off the nearest corner"),
        ("horn,0,0,0", "got 'horn'"),
        ("nose tip,0,0,0", "at least 10"),
        ("nose tip,a,0,0", "cannot be understood"),
    ):
        file.write_text(f"landmark,x,y,z\n{text}\n")
        with pytest.raises(DermisError, match=message):
            label_texels(head, atlas, table)


def test_soft_maps_stay_within_the_table_and_have_no_edge(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apply, "MIN_MAP_SIDE", 256)
    region = np.repeat(np.array([[3, 9]], np.uint8), 64, axis=1).repeat(128, axis=0)
    table = load_region_table("default")
    head, rho_s = apply.with_regions(Head("card", _quad(), Maps(region=region)), table)
    m, strength = head.maps.roughness, head.maps.specular
    assert m is not None and strength is not None
    nose, neck = table.values[3], table.values[9]
    for picture, low, high in ((m, nose[0], neck[0]), (strength, neck[1], nose[1])):
        assert low - 1e-6 <= picture.min() < low + 1e-3 and high - 1e-3 < picture.max() <= high + 1e-6
        steps = np.abs(np.diff(picture, axis=1)).max() / (high - low)
        assert steps < 0.3  # a texel is 0.8 mm, so a hard border would be a step of 1
    assert rho_s == pytest.approx((nose[1] + neck[1]) / 2, rel=0.02)


def test_specks_in_the_dark_of_the_own_map_do_not_outshine_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apply, "MIN_MAP_SIDE", 256)
    specks = np.full((256, 256), 0.5, np.float32)
    specks[:, 128:] = 0.001
    specks[40:200:40, 160:240:20] = 1.0
    for own, most in ((specks, 3.0), (0 * specks, 0.0)):
        maps = Maps(region=np.full((16, 16), 4, np.uint8), specular=own)
        head, _ = apply.with_regions(Head("card", _quad(), maps), _table(0.3, 0.2))
        assert head.maps.specular is not None
        assert head.maps.specular.max() <= most * 0.2 * (1 + 1e-5)


def test_fine_detail_of_the_own_map_stays_and_its_level_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apply, "MIN_MAP_SIDE", 256)
    stripes = np.tile(np.float32([0.5, 0.5, 1.0, 1.0]), (256, 64))
    maps = Maps(region=np.full((8, 8), 4, np.uint8), specular=stripes)
    head, rho_s = apply.with_regions(Head("card", _quad(), maps), _table(0.3, 0.2))
    assert head.maps.specular is not None
    middle = head.maps.specular[64:-64, 64:-64]
    assert middle.mean() == pytest.approx(0.2, rel=0.02)
    assert middle.max() / middle.min() == pytest.approx(2, rel=0.1)
    assert rho_s == pytest.approx(0.2, rel=0.03)


def test_softening_keeps_constants_and_does_not_mix_what_is_far() -> None:
    points = np.random.default_rng(1).uniform(0, 60, (4000, 3))
    far = (points[:, 0] > 30).astype(float)
    soft = gaussian_mean(points, np.column_stack((np.full(4000, 0.3), far)), 2.0)
    np.testing.assert_allclose(soft[:, 0], 0.3, rtol=1e-12)
    beyond = np.abs(points[:, 0] - 30) > 12
    np.testing.assert_allclose(soft[beyond, 1], far[beyond], atol=1e-12)


def test_the_default_table_is_called_what_it_is() -> None:
    table = load_region_table("default")
    assert table.values.shape == (10, 2)
    text = (Path(apply.__file__).parent / "default.toml").read_text(encoding="utf-8")
    assert "ARTIST'S VALUES, NOT MEASURED" in text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("[cheek]", "[beard]"), r"\[beard\] is none of them"),
        (lambda text: text.replace("[cheek]\nm = 0.33\nrho_s = 0.51", ""), r"\[cheek\] is missing"),
        (lambda text: text.replace("m = 0.33", "m = 0"), "cheek: m: expected a number from 0.05 to 1"),
        (lambda text: text.replace("m = 0.33", "m = nan"), "cheek: m: expected a number"),
        (lambda text: text.replace("rho_s = 0.81", "rho_s = true"), "lips: rho_s: expected a number"),
        (lambda text: text.replace("m = 0.33\n", ""), "cheek: expected m and rho_s"),
        (lambda text: "labels = 3\n" + text, "labels: expected the name of a file"),
        (lambda text: text + "[", "cannot be understood"),
    ],
)
def test_tables_that_cannot_be_are_refused(
    change: Callable[[str], str], message: str, tmp_path: Path
) -> None:
    good = (Path(apply.__file__).parent / "default.toml").read_text(encoding="utf-8")
    file = tmp_path / "regions.toml"
    file.write_text(good)
    np.testing.assert_array_equal(load_region_table(file).values, load_region_table("default").values)
    file.write_text(change(good))
    with pytest.raises(DermisError, match=message):
        load_region_table(file)


def test_the_command_refuses_before_it_loads() -> None:
    with pytest.raises(DermisError, match=r"nowhere.toml: expected default, or regions in TOML"):
        assemble_scene("nobody.obj", SceneOptions(head={"regions": "nowhere.toml"}))
    with pytest.raises(DermisError, match="--rho-s: expected only one of the two"):
        assemble_scene("nobody.obj", SceneOptions(head={"regions": "default"}, skin={"rho_s": 0.2}))


@pytest.mark.usefixtures("large_region_maps")
def test_the_command_gives_the_scan_its_regions(sample_folder: Path) -> None:
    scene, _ = assemble_scene(SCAN, SceneOptions(head={"regions": "default"}))
    low, high = (
        load_region_table("default").values.min(axis=0),
        load_region_table("default").values.max(axis=0),
    )
    roughness, specular = scene.head.maps.roughness, scene.head.maps.specular
    assert roughness is not None and specular is not None
    assert low[0] - 1e-6 <= roughness.min() and roughness.max() <= high[0] + 1e-6
    assert low[1] < scene.skin.rho_s < high[1]
    assert specular.std() > 0.02


def _table(m: float, rho_s: float) -> RegionTable:
    return RegionTable(np.tile([m, rho_s], (len(REGIONS), 1)))


def _quad() -> Mesh:
    """Return a square of 200 mm that fills the uv square."""
    from dermis.mesh.mesh import Material, build_mesh

    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    place = np.column_stack((200 * uv[:, 0] - 100, 100 - 200 * uv[:, 1], np.zeros(4))).astype(np.float32)
    corners = np.array([[0, 2, 1], [0, 3, 2]])
    normals = np.full((4, 3), np.nan)
    return build_mesh(place, uv, corners, np.zeros(2, np.int32), (Material("skin"),), normals)


def test_known_heads_have_the_usual_regions_and_others_none(sample_folder: Path) -> None:
    known, alike = load_head(SCAN), load_head(SCAN, regions="none")
    assert known.maps.roughness is not None and alike.maps.roughness is None
    wanted, _ = with_regions(alike)
    np.testing.assert_array_equal(known.maps.roughness, np.float32(wanted.maps.roughness))
    np.testing.assert_array_equal(known.maps.specular, alike.maps.specular)  # the scan's own
    bare = replace(alike, maps=Maps())
    table, usual = with_regions(bare)[0].maps, with_default_regions(bare).maps
    np.testing.assert_array_equal(usual.specular, np.float32(table.specular))
    assert with_default_regions(known) is known  # a map says the roughness
    stranger = replace(alike, name="nobody")
    assert with_default_regions(stranger) is stranger
    tiny = replace(alike, mesh=replace(alike.mesh, positions=0.1 * alike.mesh.positions))
    assert with_default_regions(tiny) is tiny  # of that name, but its landmarks are not there
    scene, _ = assemble_scene(SCAN, SceneOptions(surface="deck-2007"))
    assert scene.head.maps.roughness is None
    assert (scene.skin.specular, scene.skin.rho_s) == ("kelemen", 0.18)
