"""Connected components."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.int64]


def components(count: int, a: NDArray[np.integer], b: NDArray[np.integer]) -> Index:
    """Component of each of `count` nodes (n,), counted from 0 in the order of their first nodes.

    a, b : (l,) nodes that are linked
    """
    label = np.arange(count)
    while True:
        before = label.copy()
        least = np.minimum(before[a], before[b])
        for ends in (a, b, before[a], before[b]):  # nodes, and the nodes that they are labelled by
            np.minimum.at(label, ends, least)
        label = label[label]
        if np.array_equal(label, before):
            return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1), dtype=np.int64)
