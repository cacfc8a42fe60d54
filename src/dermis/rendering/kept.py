"""What a renderer keeps from frame to frame: for each role the thing made last."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from dermis.scene.plain import Plain

T = TypeVar("T")


class Kept:
    """Things by role, each made again only when its key changes."""

    def __init__(self) -> None:
        self._things: dict[str, tuple[Any, Any]] = {}

    def keep(self, role: str, key: Any, make: Callable[[], T]) -> T:
        """The last thing made for this role while its key stays the same."""
        old, value = self._things.get(role, (None, None))
        if value is None or not _same(old, key):
            self._things.pop(role, None)
            value = make()
            self._things[role] = (key, value)
        return value  # type: ignore[no-any-return]

    def forget_all(self) -> None:
        """Make everything again."""
        self._things.clear()


def _same(a: Any, b: Any) -> bool:
    """Equality that compares heads and atlases by identity, without touching their arrays."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    return a is b or (isinstance(a, int | str | bytes | bool | Plain) and a == b)
