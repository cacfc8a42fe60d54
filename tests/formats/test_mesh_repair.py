"""Harmless faults of meshes are mended with a note, and leave what is drawn as it was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_file import GltfFile, add_mesh
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import DermisError
from dermis.formats.load import RiggedMesh, load_rigged
from dermis.formats.mesh_checks import check_mesh
from dermis.formats.motion.sequence import load_sequence
from dermis.mesh.geometry import edges
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import plane, uv_sphere

BALL = uv_sphere(0.1, 24, 12)
COUNT, TRIANGLES = len(BALL.positions), len(BALL.triangles)


def load(
    folder: Path,
    mesh: Mesh = BALL,
    *,
    triangles: ArrayLike | None = None,
    uv: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    sampler: dict[str, int] | None = None,
    offset: bool = False,
) -> RiggedMesh:
    """Return a mesh after a round trip through a .glb file, with some of its arrays replaced.

    normals : of the file; None to leave them out
    sampler : of a texture of the material; None for a material without one
    offset : whether the texture is transformed
    """
    file = GltfFile()
    attributes = {"TEXCOORD_0": file.numbers(mesh.uv if uv is None else uv)}
    if normals is not None:
        attributes["NORMAL"] = file.numbers(normals)
    of_file = mesh.triangles if triangles is None else triangles
    index = add_mesh(file, mesh.positions, np.asarray(of_file), attributes=attributes)
    if sampler is not None:
        picture = "data:image/png;base64,iVBORw0KGgo="
        file.tree |= {"samplers": [sampler], "images": [{"uri": picture}]}
        file.tree["textures"] = [{"sampler": 0, "source": 0}]
        textures: list[dict[str, Any]] = [{"index": 0}, {"index": 0}]
        if offset:
            textures[1]["extensions"] = {"KHR_texture_transform": {"offset": [0.5, 0.5]}}
        surface = {"baseColorTexture": textures[0], "metallicRoughnessTexture": textures[1]}
        file.tree["materials"] = [{"name": "skin", "pbrMetallicRoughness": surface}]
        file.tree["meshes"][index]["primitives"][0]["material"] = 0
    return load_rigged(file.write(folder / "a.glb", file.add("nodes", mesh=index)))


def note(loaded: RiggedMesh) -> str:
    """Return the only note on a mesh."""
    check_mesh(loaded.mesh, "mended")
    (text,) = loaded.notes
    return text


def joined(*meshes: Mesh) -> Mesh:
    start = np.cumsum([0, *(len(one.positions) for one in meshes)])
    triangles = [one.triangles + offset for one, offset in zip(meshes, start, strict=False)]
    arrays = [np.vstack([getattr(one, name) for one in meshes]) for name in ("positions", "uv")]
    count = sum(map(len, triangles))
    return build_mesh(*arrays, np.vstack(triangles), np.zeros(count), BALL.materials)


def inverted(mesh: Mesh) -> Mesh:
    return replace(mesh, triangles=mesh.triangles[:, ::-1].copy())


def moved(mesh: Mesh, *offset: float) -> Mesh:
    return replace(mesh, positions=mesh.positions + np.float32(offset))


def with_points(points: ArrayLike, triangles: ArrayLike) -> Mesh:
    """Return the ball with further vertices and triangles."""
    uv = np.full((len(np.asarray(points)), 2), 0.5)
    more = np.vstack((BALL.triangles, triangles))
    positions = np.vstack((BALL.positions, points))
    return build_mesh(positions, np.vstack((BALL.uv, uv)), more, np.zeros(len(more)), BALL.materials)


def crosses(mesh: Mesh) -> NDArray[np.float64]:
    a, b, c = (mesh.positions[corner].astype(float) for corner in mesh.triangles.T)
    return np.cross(b - a, c - a)


def volume(mesh: Mesh) -> float:
    """Return the volume of a closed mesh in units of that of the ball."""
    return volume_mm3(mesh) / volume_mm3(replace(BALL, positions=1000 * BALL.positions))


def volume_mm3(mesh: Mesh) -> float:
    return float((crosses(mesh) * mesh.positions[mesh.triangles[:, 0]]).sum() / 6)


def same_triangles(mesh: Mesh, other: Mesh) -> bool:
    return np.array_equal(mesh.triangles, other.triangles) and np.array_equal(mesh.positions, other.positions)


def test_valid_mesh_has_no_notes(tmp_path: Path) -> None:
    loaded = load(tmp_path, normals=BALL.normals)
    assert loaded.notes == () and np.array_equal(loaded.mesh.triangles, BALL.triangles)
    np.testing.assert_array_equal(loaded.mesh.uv, BALL.uv)


@pytest.mark.parametrize("bad", [[0, 0, 1], [5, 5, 5], [1, 25, 1]])
def test_triangles_without_area_are_left_out(tmp_path: Path, bad: list[int]) -> None:
    loaded = load(tmp_path, triangles=[bad, *BALL.triangles])
    assert note(loaded) == "left out 1 triangle without area"
    assert same_triangles(loaded.mesh, load(tmp_path).mesh)


def test_a_mesh_that_is_mostly_flat_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="zero area"):
        load(tmp_path, replace(BALL, positions=BALL.positions * np.float32([0, 1, 0])))


@pytest.mark.parametrize("turn", [1, -1])
def test_repeated_triangles_are_left_out(tmp_path: Path, turn: int) -> None:
    loaded = load(tmp_path, triangles=np.vstack((BALL.triangles, BALL.triangles[7:9, ::turn])))
    assert note(loaded) == "left out 2 triangles that repeat others"
    assert same_triangles(loaded.mesh, load(tmp_path).mesh)


def test_coinciding_opposite_triangles_are_kept_once(tmp_path: Path) -> None:
    loaded = load(tmp_path, triangles=np.vstack((BALL.triangles, BALL.triangles[:, ::-1])))
    assert note(loaded) == f"left out {TRIANGLES} triangles that repeat others"
    assert volume(loaded.mesh) == pytest.approx(1)


def test_fin_becomes_a_separate_surface(tmp_path: Path) -> None:
    a, b = BALL.triangles[200, :2]
    loaded = load(tmp_path, with_points([[0, 0, 0.3]], [[a, b, COUNT]]))
    assert note(loaded) == "separated the sheets that meet at 1 edge of more than two triangles"
    mesh, plain = loaded.mesh, load(tmp_path).mesh
    assert len(mesh.triangles) == TRIANGLES + 1
    np.testing.assert_array_equal(mesh.point[mesh.triangles[:-1]], plain.point[plain.triangles])
    assert not np.isin(mesh.point[mesh.triangles[-1]], mesh.point[mesh.triangles[:-1]]).any()
    np.testing.assert_allclose(mesh.normals[:COUNT], plain.normals, atol=1e-6)


def test_inner_wall_becomes_a_separate_surface(tmp_path: Path) -> None:
    ring = np.flatnonzero(np.abs(BALL.positions[:, 1]) < 1e-6)[:-1]
    wall = np.column_stack((ring, np.roll(ring, -1), np.full(len(ring), COUNT)))
    loaded = load(tmp_path, with_points([[0, 0, 0]], wall))
    assert "at 24 edges" in note(loaded)
    of_ball, of_wall = (loaded.mesh.point[part] for part in np.split(loaded.mesh.triangles, [TRIANGLES]))
    assert not np.isin(of_ball, of_wall).any() and edges(of_ball)[2].min() == 2


@pytest.mark.parametrize(
    "triangles",
    [
        [[6, 2, 5], [5, 6, 1], [1, 2, 4], [4, 2, 6], [0, 2, 4], [2, 1, 6], [1, 5, 3]],
        [[1, 0, 6], [1, 0, 3], [6, 5, 0], [0, 3, 6], [6, 1, 2], [2, 6, 5]],
        [[4, 0, 6], [2, 3, 6], [1, 2, 0], [6, 4, 1], [2, 1, 4], [4, 0, 1]],
    ],
)
def test_a_surface_that_meets_itself_at_an_edge_is_cut_there(tmp_path: Path, triangles: ArrayLike) -> None:
    positions = np.random.default_rng(5).normal(size=(7, 3))
    mesh = build_mesh(positions, np.full((7, 2), 0.5), triangles, np.zeros(len(triangles)), BALL.materials)
    assert edges(mesh.point[mesh.triangles])[2].max() > 2
    loaded = load(tmp_path, mesh)
    check_mesh(loaded.mesh, "mended")
    uses = np.bincount(loaded.mesh.point)[loaded.mesh.point[loaded.mesh.triangles]]
    assert (uses == 1).all(axis=1).any()  # a triangle of its own
    assert "separated the sheets" in loaded.notes[0] and len(loaded.mesh.triangles) == len(triangles)


def test_many_surfaces_at_one_edge_are_separated(tmp_path: Path) -> None:
    tips = [[np.cos(t), np.sin(t), 0.5] for t in np.linspace(0, 6, 20)]
    fan = [[0, 1, 2 + k] for k in range(20)]
    positions = [[0, 0, 0], [0, 0, 1], *tips]
    mesh = build_mesh(positions, np.full((22, 2), 0.5), fan, np.zeros(20), BALL.materials)
    loaded = load(tmp_path, mesh)
    assert "at 1 edge" in note(loaded) and len(np.unique(loaded.mesh.point)) == 60


def test_too_many_non_manifold_edges_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dermis.formats.mesh_repair._MAX_NON_MANIFOLD_EDGES", 1)
    with pytest.raises(DermisError, match="non-manifold"):
        load(tmp_path, with_points([[0, 0, 0.3]], [[0, 25, COUNT], [60, 61, COUNT], [80, 81, COUNT]]))


def test_coinciding_parts_of_different_materials_are_kept(tmp_path: Path) -> None:
    file = GltfFile()
    both = [add_mesh(file, BALL.positions, one) for one in (BALL.triangles, BALL.triangles[100:120])]
    file.tree["materials"] = [{"name": "skin"}, {"name": "paint"}]
    for index, mesh in enumerate(both):
        file.tree["meshes"][mesh]["primitives"][0]["material"] = index
    nodes = [file.add("nodes", mesh=mesh) for mesh in both]
    loaded = load_rigged(file.write(tmp_path / "a.glb", *nodes))
    skin = np.array([one.kind == "skin" for one in loaded.mesh.materials])[loaded.mesh.material]
    assert len(loaded.mesh.triangles) == TRIANGLES + 20 and "separated the sheets" in loaded.notes[-1]
    assert edges(loaded.mesh.point[loaded.mesh.triangles[skin]])[2].min() == 2


def load_groups(folder: Path, *groups: tuple[str, NDArray[Any]]) -> RiggedMesh:
    """Return a mesh of groups of triangles of a ball, as an OBJ file."""
    rows = [f"v {x} {y} {z}" for x, y, z in 1000 * BALL.positions] + [f"vt {u} {1 - v}" for u, v in BALL.uv]
    for name, triangles in groups:
        rows += [f"usemtl {name}", *(f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in triangles + 1)]
    (folder / "a.obj").write_text("\n".join(rows))
    return load_rigged(folder / "a.obj", unit_mm=1.0)


@pytest.mark.parametrize(
    ("names", "kept"),
    [
        (("skin", "paint"), "skin"),
        (("paint", "skin"), "skin"),
        (("skin_b", "skin_a"), "skin_b"),
        (("skin", "b", "a"), "skin"),
    ],
)
@pytest.mark.parametrize("inside_out", [False, True])
def test_of_coinciding_shells_the_skin_or_the_first_is_kept(
    tmp_path: Path, names: tuple[str, ...], kept: str, inside_out: bool
) -> None:
    first, *others = names
    copy = BALL.triangles[:, ::-1] if inside_out else BALL.triangles
    loaded = load_groups(tmp_path, (first, BALL.triangles), *((name, copy) for name in others))
    assert [one.name for one in loaded.mesh.materials] == [kept] and len(loaded.mesh.triangles) == TRIANGLES
    assert loaded.surface.has_uv == (True,) and len(loaded.surface.in_file) == 1
    assert f"left out {TRIANGLES * len(others):,} triangles that repeat others" in loaded.notes
    left_out = ", ".join(sorted(set(names) - {kept}, key=names.index))
    assert f"nothing remains of these groups: {left_out}" in loaded.notes


def test_group_of_only_flat_triangles_is_left_out(tmp_path: Path) -> None:
    flat = np.array([[0, 0, 1], [2, 2, 2]])
    loaded = load_groups(tmp_path, ("skin_b", flat), ("skin", BALL.triangles), ("hair", BALL.triangles[:9]))
    assert [one.name for one in loaded.mesh.materials] == ["skin", "hair"]
    assert np.bincount(loaded.mesh.material).tolist() == [TRIANGLES, 9]
    assert "nothing remains of these groups: skin_b" in loaded.notes
    with pytest.raises(DermisError, match=r"has no triangles|no area|area"):
        load_groups(tmp_path, ("skin", flat), ("hair", BALL.triangles[:1]))


@pytest.mark.parametrize("of_file", ["none", "outwards", "inwards"])
def test_inverted_closed_mesh_is_reversed(tmp_path: Path, of_file: str) -> None:
    normals = {"none": None, "outwards": BALL.normals, "inwards": -BALL.normals}[of_file]
    loaded = load(tmp_path, inverted(BALL), normals=normals)
    check_mesh(loaded.mesh, "mended")
    expected = [f"reversed {TRIANGLES} triangles of {TRIANGLES} that are wound inside out"]
    expected += [f"turned {COUNT} normals outwards"] if of_file == "inwards" else []
    assert list(loaded.notes) == expected
    assert volume(loaded.mesh) == pytest.approx(1)
    np.testing.assert_allclose(
        loaded.mesh.normals, load(tmp_path, normals=BALL.normals).mesh.normals, atol=0.1
    )


def test_triangles_of_both_windings_are_made_consistent(tmp_path: Path) -> None:
    some = np.random.default_rng(0).random(TRIANGLES) < 0.3
    loaded = load(tmp_path, triangles=np.where(some[:, None], BALL.triangles[:, ::-1], BALL.triangles))
    assert f"reversed {some.sum()} triangles" in note(loaded) and volume(loaded.mesh) == pytest.approx(1)


def test_inward_normals_are_flipped(tmp_path: Path) -> None:
    loaded = load(tmp_path, normals=-BALL.normals)
    assert note(loaded) == f"turned {COUNT} normals outwards"
    np.testing.assert_allclose(loaded.mesh.normals, BALL.normals, atol=1e-6)


@pytest.mark.parametrize("height", [-0.06, 0.0])
def test_open_mesh_is_oriented_by_its_visible_side(tmp_path: Path, height: float) -> None:
    above = BALL.triangles[BALL.positions[BALL.triangles].mean(axis=1)[:, 1] > height]
    assert load(tmp_path, triangles=above).notes == ()
    loaded = load(tmp_path, triangles=above[:, ::-1])
    assert "wound inside out" in note(loaded)
    assert (crosses(loaded.mesh) * loaded.mesh.positions[loaded.mesh.triangles[:, 0]]).sum(axis=1).min() > 0


def test_flat_component_follows_the_normals_of_the_file(tmp_path: Path) -> None:
    patch = plane(0.06, 4)
    assert load(tmp_path, patch, normals=patch.normals).notes == load(tmp_path, inverted(patch)).notes == ()
    loaded = load(tmp_path, inverted(patch), normals=patch.normals)
    assert note(loaded).startswith("reversed 32 triangles") and crosses(loaded.mesh)[:, 2].min() > 0
    np.testing.assert_array_equal(loaded.mesh.normals, patch.normals)


def test_concave_patch_is_not_reversed(tmp_path: Path) -> None:
    above = BALL.triangles[BALL.positions[BALL.triangles].mean(axis=1)[:, 1] > 0.07]
    assert load(tmp_path, triangles=above[:, ::-1], normals=-BALL.normals).notes == ()


def test_only_an_inverted_eyeball_is_reversed(tmp_path: Path) -> None:
    eye = moved(uv_sphere(0.012, 12, 8), 0.03, 0.02, 0.092)
    loaded = load(tmp_path, joined(BALL, inverted(eye)))
    assert note(loaded).startswith(f"reversed {len(eye.triangles)} triangles of")


def test_inner_wall_of_a_hollow_mesh_is_not_reversed(tmp_path: Path) -> None:
    shell = joined(BALL, inverted(uv_sphere(0.09, 24, 12)))
    assert load(tmp_path, shell).notes == ()
    assert f"reversed {2 * TRIANGLES:,} triangles" in note(load(tmp_path, inverted(shell)))


def test_moebius_strip_is_unchanged(tmp_path: Path) -> None:
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)[:, None]
    along = np.hstack((np.cos(turn), np.sin(turn), 0 * turn))
    across = 0.3 * np.hstack(
        (np.cos(turn / 2) * np.cos(turn), np.cos(turn / 2) * np.sin(turn), np.sin(turn / 2))
    )
    first, second = np.arange(40), np.roll(np.arange(40), -1)
    swapped = np.where(second == 0, 40, 0)  # the last two vertices meet the first two crosswise
    a, b, c, d = first, first + 40, second + swapped, second + 40 - swapped
    triangles = np.vstack((np.column_stack((a, b, c)), np.column_stack((c, b, d))))
    positions = 0.1 * np.vstack((along - across, along + across))
    mesh = build_mesh(positions, np.full((80, 2), 0.5), triangles, np.zeros(80), BALL.materials)
    check_mesh(load(tmp_path, mesh).mesh, "strip")


def test_zero_normals_are_recomputed(tmp_path: Path) -> None:
    normals = BALL.normals.copy()
    normals[3], normals[5] = np.nan, 0
    loaded = load(tmp_path, normals=normals)
    assert note(loaded) == "computed 2 normals that are NaN or have no length"
    np.testing.assert_allclose(loaded.mesh.normals, BALL.normals, atol=0.02)


def test_unused_vertices_may_have_any_values(tmp_path: Path) -> None:
    positions = np.vstack((BALL.positions[:5], [[np.nan] * 3, [1e30] * 3], BALL.positions[5:]))
    uv = np.vstack((BALL.uv[:5], [[np.inf] * 2] * 2, BALL.uv[5:]))
    triangles = BALL.triangles + 2 * (BALL.triangles >= 5)
    loaded = load(tmp_path, replace(BALL, positions=positions, uv=uv), triangles=triangles)
    assert loaded.notes == () and same_triangles(loaded.mesh, load(tmp_path).mesh)


def test_uv_slightly_outside_the_tile_are_clamped(tmp_path: Path) -> None:
    loaded = load(tmp_path, uv=1.03 * BALL.uv - 0.015)
    assert note(loaded) == "clamped uv that are up to 0.015 outside the tile"
    np.testing.assert_allclose(loaded.mesh.uv, BALL.uv, atol=0.0151)


def test_uv_one_tile_away_are_moved(tmp_path: Path) -> None:
    loaded = load(tmp_path, uv=BALL.uv + np.array([3, -2]))
    assert note(loaded) == "moved 1 of 1 uv chart by whole tiles into [0, 1]"
    np.testing.assert_allclose(loaded.mesh.uv, BALL.uv, atol=1e-6)


def test_each_uv_chart_is_moved_separately(tmp_path: Path) -> None:
    both = joined(BALL, moved(uv_sphere(0.02, 12, 8), 0, 0, 0.2))
    shift = np.where(np.arange(len(both.uv)) < COUNT, 0, 1)[:, None]
    loaded = load(tmp_path, both, uv=both.uv + shift)
    assert note(loaded) == "moved 1 of 2 uv charts by whole tiles into [0, 1]"
    np.testing.assert_allclose(loaded.mesh.uv, both.uv, atol=1e-6)


def test_charts_larger_than_a_tile_are_not_moved(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="u runs from 0 to 3"):
        load(tmp_path, uv=3 * BALL.uv)


REPEATED, MIRRORED, CLAMPED = 10497, 33648, 33071


@pytest.mark.parametrize(
    ("wrap", "shift", "is_moved"),
    [(REPEATED, 1, True), (MIRRORED, 2, True), (MIRRORED, 1, False), (CLAMPED, 1, False)],
)
def test_uv_are_moved_by_the_repetition_of_pictures(
    tmp_path: Path, wrap: int, shift: int, is_moved: bool
) -> None:
    try:
        notes = load(tmp_path, uv=BALL.uv + np.array([shift, 0]), sampler={"wrapS": wrap}).notes
    except DermisError:
        notes = ()
    assert any("whole tiles" in text for text in notes) == is_moved


def test_targets_and_bones_follow_separated_surfaces(tmp_path: Path) -> None:
    a, b = BALL.triangles[200, :2]
    finned, file = with_points([[0, 0, 0.3]], [[0, 0, 1], [a, b, COUNT]]), GltfFile()
    share = np.clip(5 * finned.positions[:, 1] + 0.5, 0, 1)
    weights = np.column_stack((share, 1 - share, 0 * share, 0 * share))
    bones = np.tile([0, 1, 0, 0], (COUNT + 1, 1))
    attributes = {"JOINTS_0": file.numbers(bones, "<u1"), "WEIGHTS_0": file.numbers(weights)}
    targets = {"grow": file.numbers(finned.positions), "rise": file.sparse(finned.positions > 0.05)}
    mesh = add_mesh(file, finned.positions, inverted(finned).triangles, targets, attributes)
    skin = file.add("skins", joints=[0, 1])
    nodes = [file.add("nodes", name=name) for name in ("top", "bottom")]
    nodes.append(file.add("nodes", mesh=mesh, skin=skin))
    rig = load_rigged(file.write(tmp_path / "a.glb", *nodes)).rig
    assert rig is not None and rig.skeleton is not None and len(rig.positions_mm) == len(BALL.points_mm) + 3
    grown, risen = (np.zeros_like(rig.positions_mm) for _ in range(2))
    for index, moved_points in enumerate((grown, risen)):
        rows = slice(*rig.targets.first[index : index + 2])
        moved_points[rig.targets.point[rows]] = rig.targets.delta_mm[rows]
    np.testing.assert_allclose(grown, rig.positions_mm, atol=1e-3)
    np.testing.assert_array_equal(risen, 1000 * (rig.positions_mm > 50))
    expected = np.clip(rig.positions_mm[:, 1] / 200 + 0.5, 0, 1)
    own = (rig.skeleton.weight * (rig.skeleton.bone == 0))[:, :2].max(axis=1)
    np.testing.assert_allclose(own, expected, atol=1e-5)


def test_quads_follow_their_triangles(tmp_path: Path) -> None:
    rows = [f"v {x} {y} {x * x + y * y}\nvt {x / 3} {y / 3}" for y in range(4) for x in range(4)]
    first = [1, 2, 3, 5, 6, 7, 9, 10, 11]
    quads = [f"f {k}/{k} {k + 4}/{k + 4} {k + 5}/{k + 5} {k + 1}/{k + 1}" for k in first]
    lines = [*rows, quads[0], "f 1/1 1/1 2/2", "f 5/5 6/6 7/7 7/7", *quads[1:]]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    mesh = load_rigged(tmp_path / "a.obj").mesh
    assert len(mesh.triangles) == 19 and len(mesh.quads) == 9
    one, two = mesh.triangles[mesh.quads].transpose(1, 0, 2)
    np.testing.assert_array_equal(one[:, [0, 2]], two[:, [2, 0]])


def test_sequence_animates_a_repaired_head(tmp_path: Path) -> None:
    for frame, scale in enumerate((1, 1.1)):
        rows = [f"v {x * scale} {y} {z}" for x, y, z in 1000 * BALL.positions]
        rows += [f"vt {u} {1 - v}" for u, v in BALL.uv]
        rows += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in inverted(BALL).triangles + 1]
        (tmp_path / f"a{frame}.obj").write_text("\n".join([*rows, "f 1/1 1/1 2/2"]))
    mesh, rig, notes, *_ = load_rigged(tmp_path / "a0.obj", unit_mm=1.0)
    assert len(notes) == 2
    clip = load_sequence(tmp_path, Head("ball", mesh, Maps(), rig=rig), fps=1, unit_mm=1.0)
    positions = clip.sample(1.0).positions_mm
    assert positions is not None
    np.testing.assert_allclose(positions[:, 0], 1.1 * mesh.points_mm[:, 0], rtol=1e-4, atol=1e-4)
