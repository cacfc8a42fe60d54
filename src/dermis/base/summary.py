"""Short reprs of objects that hold large arrays."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import fields
from typing import Any, cast

import numpy as np

_MAX_SHOWN_ITEMS = 6  # longest collection whose items are written
_MAX_REPR_LENGTH = 60  # characters of a value


class ShortRepr:
    """Mixin that gives dataclasses with `repr=False` a repr with types and shapes instead of large arrays."""

    def __repr__(self) -> str:
        """Return the class name and the fields, each abbreviated by `short_repr`."""
        own_fields = fields(cast(Any, self))
        parts = [f"{one.name}={short_repr(getattr(self, one.name))}" for one in own_fields if one.repr]
        return f"{type(self).__name__}({', '.join(parts)})"


def short_repr(value: object) -> str:
    """Return the repr of a value; for arrays and long collections, the type with the shape or length."""
    if isinstance(value, np.ndarray):
        names = value.dtype.names
        return f"{value.dtype if names is None else f'{len(names)} fields'}{list(value.shape)}"
    if isinstance(value, Collection) and (len(value) > _MAX_SHOWN_ITEMS or not _is_short(value)):
        return value.__repr__() if isinstance(value, str) else f"<{len(value):,} in a {type(value).__name__}>"
    text = repr(value)
    return text if len(text) <= _MAX_REPR_LENGTH else f"<{type(value).__name__}>"


def _is_short(value: Collection[Any]) -> bool:
    return not any(isinstance(one, np.ndarray) for one in value) and len(repr(value)) <= _MAX_REPR_LENGTH
