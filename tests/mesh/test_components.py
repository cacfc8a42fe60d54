"""Connected components compared with SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dermis.mesh.geometry import label_components


@pytest.mark.parametrize("links", [0, 1, 300, 700, 3000])
def test_components_match_scipy(links: int) -> None:
    a, b = np.random.default_rng(links).integers(0, 1000, (2, links))
    graph = coo_array((np.ones(links), (a, b)), shape=(1000, 1000))
    assert np.array_equal(label_components(1000, a, b), connected_components(graph, directed=False)[1])


def test_a_long_chain_is_one_component() -> None:
    order = np.random.default_rng(1).permutation(5000)
    assert not label_components(5000, order[:-1], order[1:]).any()


def test_empty_mesh_has_no_components() -> None:
    none = np.zeros(0, np.int64)
    assert len(label_components(0, none, none)) == 0
