"""How a head is moved from where it rests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class Pose:
    """Weights of morph targets, turns of bones, or places of all points.

    weights : of targets by name, mostly 0 to 1
    bones : by name; three angles [degrees] about the head's own axes (x: nod, y: turn, z: tilt) from where
        the bone rests, done about z first, then x, then y; or a (4, 4) matrix from its space to its parent's
        instead of the one at rest, in the file's units, as animations have
    positions_mm : (n, 3) all points of the control mesh, as `Head.positions_mm` lists them, instead of those
        at rest: another person of the same topology, or a motion from elsewhere
    """

    weights: Mapping[str, float] = field(default_factory=dict)
    bones: Mapping[str, ArrayLike] = field(default_factory=dict)
    positions_mm: NDArray[np.float32] | None = None

    @classmethod
    def of(cls, given: Any) -> Pose | None:
        """A pose, the pose of a plain mapping of weights, or None."""
        return given if given is None or isinstance(given, Pose) else cls(weights=given)
