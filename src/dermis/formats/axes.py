"""Coordinate axes of files: the axis that points up, and the axis along which the face looks.

NumPy is imported on first use, so that command-line help appears quickly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from dermis.base.arrays import Doubles

Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
Front = Literal["auto", "x", "y", "z", "-x", "-y", "-z"]


class Axes(NamedTuple):
    """Up axis and front axis of a file.

    up : axis that points upwards; None if the axis is unknown, in which case Y is assumed
    front : axis along which the face looks, perpendicular to `up`; "auto" if the axis is unknown, in which
        case -Y is assumed if Z is up (as in Blender), and Z otherwise
    """

    up: Axis | None = None
    front: Front = "auto"

    @property
    def up_or_default(self) -> Axis:
        """Return the axis that points upwards: `up`, or Y if `up` is None."""
        return self.up or "y"

    @property
    def front_or_default(self) -> Axis:
        """Return the axis along which the face looks: `front`, or the axis assumed for "auto", see `Axes`."""
        if self.front != "auto":
            return self.front
        return "-y" if self.up in ("z", "-z") else "z"

    def fill_unknown_from(self, stated_axes: Axes) -> Axes:
        """Return a copy of these axes in which the axes stated by a file replace unknown axes.

        An unknown front is replaced by the file's front only if the copy and the file have the same up axis.

        stated_axes : axes that the file states
        """
        chosen = self._replace(up=self.up or stated_axes.up)
        same = chosen.front == "auto" and chosen.up_or_default == stated_axes.up_or_default
        return chosen._replace(front=stated_axes.front) if same else chosen


DEFAULT_AXES = Axes()


def to_y_up(vectors: Doubles, file_axes: Axes) -> Doubles:
    """Rotate vectors (v, 3) of a file so that the file's up axis becomes +Y and its front becomes +Z."""
    import numpy as np

    if (file_axes.up_or_default, file_axes.front_or_default) == ("y", "z"):
        return vectors
    (up, up_sign), (front, front_sign) = (
        _axis_index_and_sign(file_axes.up_or_default),
        _axis_index_and_sign(file_axes.front_or_default),
    )
    side = 3 - up - front
    side_sign = up_sign * front_sign * (1 if (up + 1) % 3 == front else -1)
    columns = (side, side_sign), (up, up_sign), (front, front_sign)
    return np.column_stack([vectors[:, k] if sign > 0 else -vectors[:, k] for k, sign in columns])


def head_axis_in_file(head_axis: Axis, file_axes: Axes) -> Axis:
    """Return the axis of a file that becomes a given axis of the head when `to_y_up` rotates the file.

    head_axis : the given axis of the head
    file_axes : up axis and front axis of the file
    """
    import numpy as np

    index, sign = _axis_index_and_sign(head_axis)
    along = sign * to_y_up(np.eye(3), file_axes)[:, index]
    names: tuple[Axis, ...] = ("x", "y", "z", "-x", "-y", "-z")
    return names[int(np.concatenate((along, -along)).argmax())]


def _axis_index_and_sign(axis: Axis) -> tuple[int, int]:
    """Return the index of an axis, 0 to 2, and its sign."""
    return "xyz".index(axis[-1]), -1 if axis[0] == "-" else 1
