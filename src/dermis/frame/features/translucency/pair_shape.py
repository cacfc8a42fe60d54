"""Choice of the head shape, at rest or deformed, that is searched for translucent pairs.

A pair is two cells of the skin on opposite sides of a thin part of the head.
"""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Floats, Intp
from dermis.frame.request import FrameRequest
from dermis.gpu import Memo
from dermis.mesh.head import Head

MAX_SHARED_PAIR_STRAIN = 0.2
"""Largest strain of a shape that still uses the pairs of the head at rest, see `StrainGauge.strain` [-]."""
_SAMPLED_LENGTH_COUNT, _SAMPLING_SEED = 2000, 0
_STRAIN_QUANTILE = 0.9  # quantile of the changes of length; it ignores the few lengths from lip to lip


class StrainGauge:
    """Measure of the strain of a deformed head, from distances between neighbouring control points."""

    def __init__(self, head: Head) -> None:
        from scipy.spatial import cKDTree

        self._rest_mm = head.control_rig.positions_mm
        count = len(self._rest_mm)
        sample = np.random.default_rng(_SAMPLING_SEED).permutation(count)[:_SAMPLED_LENGTH_COUNT]
        nearest = np.asarray(cKDTree(self._rest_mm[sample]).query(self._rest_mm[sample], 2)[1])
        pairs: Intp = np.column_stack([sample, sample[nearest[:, 1]]])
        self._pairs = pairs[self._pair_lengths(self._rest_mm, pairs) > 0.0]
        self._rest_lengths = self._pair_lengths(self._rest_mm, self._pairs)

    def strain(self, positions_mm: Floats) -> float:
        """Return the strain of a shape, which is a relative change of distances [-].

        It is the 90th percentile of the relative changes of the distances between neighbouring control
        points.

        positions_mm : (p, 3) control points of the shape [mm]
        """
        lengths = self._pair_lengths(positions_mm, self._pairs)
        return float(np.quantile(np.abs(lengths / self._rest_lengths - 1.0), _STRAIN_QUANTILE))

    @staticmethod
    def _pair_lengths(positions_mm: Floats, pairs: Intp) -> Floats:
        offset = positions_mm[pairs[:, 0]] - positions_mm[pairs[:, 1]]
        return np.asarray(np.linalg.norm(offset, axis=1))


def pair_positions_mm(memo: Memo, request: FrameRequest) -> Floats | None:
    """Return the control points of the shape that is searched for pairs [mm], None for the head at rest.

    A pair is two cells of the skin on opposite sides of a thin part. All people of one template use the pairs
    of the template at rest. Other heads use their pairs at rest for all shapes with a strain of at most
    `MAX_SHARED_PAIR_STRAIN`.
    """
    positions = request.rest_positions_mm
    if positions is None or request.has_shared_mesh:
        return None
    gauge = memo.get(StrainGauge, request.topology_head)
    return positions if gauge.strain(positions) > MAX_SHARED_PAIR_STRAIN else None
