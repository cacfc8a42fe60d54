"""The [pose] of a scene as plain data."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from dermis.scene.findings import Because
from dermis.scene.plain import Plain
from dermis.scene.pose import MOST_WEIGHT

_Weight = Annotated[float, Field(ge=-MOST_WEIGHT, le=MOST_WEIGHT), Because("faces come apart long before")]


class PoseTable(Plain):
    """The [pose] of a scene: what `Pose` takes, without places of points, for which a text is too long."""

    weights: dict[str, _Weight] = Field(default_factory=dict)
    """Weights of morph targets by name, mostly 0 to 1."""
    bones: dict[str, Any] = Field(default_factory=dict)
    """By name of the bone: three angles about the head's x, y and z [degrees], or a (4, 4) matrix."""
