"""Numbers of `dermis profile` as text and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from dermis.optics.media import Floats


def row(values: Floats) -> str:
    """Three numbers of a report."""
    return " ".join(f"{value:7.4f}" for value in values)


def plain(value: Any) -> Any:
    """Arrays as lists, without what is None."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items() if one is not None}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    return value
