"""What data of many numbers print as: a line, in which arrays are told by kind and shape."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import fields
from typing import Any

import numpy as np

_MOST = 6  # of a collection that are written out
_LONGEST = 60  # letters of a value


class Summarised:
    """For dataclasses with `repr=False`: their fields, but no megabytes."""

    def __repr__(self) -> str:
        told: Any = self
        parts = [f"{one.name}={summary(getattr(self, one.name))}" for one in fields(told) if one.repr]
        return f"{type(self).__name__}({', '.join(parts)})"


def summary(value: object) -> str:
    """A value as it prints if that is short; arrays, collections and others by what they are."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{list(value.shape)}"
    if isinstance(value, Collection) and (len(value) > _MOST or not _is_short(value)):
        return value.__repr__() if isinstance(value, str) else f"<{len(value):,} in a {type(value).__name__}>"
    text = repr(value)
    return text if len(text) <= _LONGEST else f"<{type(value).__name__}>"


def _is_short(value: Collection[Any]) -> bool:
    return not any(isinstance(one, np.ndarray) for one in value) and len(repr(value)) <= _LONGEST
