"""Triangles that may belong to translucent pairs: none is missed, and the search finds every pair."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from translucency_truth import hook

from dermis.atlas.build import build_atlas
from dermis.atlas.translucency import pairs as search
from dermis.atlas.translucency.pairs import TranslucentPairs, facing, find_pairs
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import uv_sphere, wedge

ASKEW = 0.5
MESHES = {
    "rim": hook,
    "slab": lambda: wedge(30.0, 2.0, 4.0, cells=6),
    "ball": lambda: uv_sphere(20.0, 48, 24),
}


def faced(mesh: Mesh, radius_mm: float) -> NDArray[np.bool_]:
    return facing(mesh, np.ones(len(mesh.triangles), bool), radius_mm)


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("radius_mm", [1.0, 3.0])
def test_no_triangle_with_a_pair_is_missed(name: str, radius_mm: float) -> None:
    mesh, chance = MESHES[name](), np.random.default_rng(5)
    weight = chance.dirichlet(np.ones(3), (4, len(mesh.triangles)))
    place, normal = (
        np.einsum("nfk,fkc->nfc", weight, a[mesh.triangles].astype(float)).reshape(-1, 3)
        for a in (mesh.positions, mesh.normals)
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    which = np.tile(np.arange(len(mesh.triangles)), 4)
    found = faced(mesh, radius_mm)
    for k in range(0, len(place), 499):
        near = np.linalg.norm(place - place[k], axis=1) < radius_mm
        if (near & (normal @ normal[k] < ASKEW)).any():
            assert found[which[k]]


def test_only_the_rim_of_a_thick_slab_is_left() -> None:
    mesh = wedge(60.0, 10.0, 10.0, cells=30)
    found, corners = faced(mesh, 3.0), mesh.positions[mesh.triangles]
    away = np.abs(corners[..., :2]).max(axis=(1, 2)) < 24.0
    assert away.any() and not found[away].any()
    assert found.any()
    assert faced(mesh, 12.0).all()


def test_triangles_without_light_have_no_pairs() -> None:
    mesh = wedge(30.0, 1.0, 1.0, cells=4)
    front = mesh.normals[mesh.triangles][:, :, 2].min(axis=1) > 0.9
    assert facing(mesh, np.ones(len(front), bool), 3.0)[front].all()
    inner = front & (np.abs(mesh.positions[mesh.triangles]).max(axis=(1, 2)) < 12.0)
    assert inner.any() and not facing(mesh, inner, 3.0).any()
    assert not facing(mesh, np.zeros(len(front), bool), 3.0).any()


def listed(table: TranslucentPairs) -> tuple[NDArray[np.integer], ...]:
    """Every pair, whatever the order of a receiver's pairs."""
    receiver = np.repeat(np.arange(len(table.first) - 1), np.diff(table.first.astype(np.int64)))
    order = np.lexsort((table.source, receiver))
    return receiver[order], table.texel[table.source[order]], table.geometry[order]


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("layout", ["mesh", "stitched"])
def test_what_is_left_out_has_no_pairs(name: str, layout: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = MESHES[name]()
    atlas = build_atlas(mesh, 128, layout)
    few = find_pairs(mesh, atlas, 0.7)
    monkeypatch.setattr(search, "facing", lambda mesh, shown, radius_mm: np.ones_like(shown))
    every = find_pairs(mesh, atlas, 0.7)
    assert all(np.array_equal(a, b) for a, b in zip(listed(few), listed(every), strict=True))
    for part in ("receiver", "first", "texel", "area_mm2", "radius_mm", "spacing_mm"):
        assert np.array_equal(getattr(few, part), getattr(every, part)), part
    assert len(every.source) > 100 or name == "ball"
