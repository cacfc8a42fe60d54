"""What a renderer keeps from frame to frame: for each role the things used last."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, TypeVar

from dermis.scene.plain import Plain

T = TypeVar("T")
Keep = Callable[[str, Any, Callable[[], Any]], Any]
"""`Kept.keep`."""


class Kept:
    """Things by role, each made again only when its key changes.

    depth : how many things of each role are kept, for who goes back and forth between some; a role that
        nobody asks for is kept for the square of that many rounds, as there may be roles in turn as well
    """

    def __init__(self, depth: int = 1) -> None:
        self._depth = depth
        self._things: dict[str, list[tuple[Any, Any]]] = {}
        self._asked: deque[set[str]] = deque([set()], maxlen=depth * depth)
        self._last: set[str] = set()

    def keep(self, role: str, key: Any, make: Callable[[], T]) -> T:
        """The thing of this role and key, made unless it is one of those used last."""
        self._asked[-1].add(role)
        things = self._things.setdefault(role, [])
        found = next((k for k, (old, _) in enumerate(things) if same(old, key)), None)
        if found is None:
            del things[self._depth - 1 :]  # before making, which may need the space
            things.insert(0, (key, make()))
        else:
            things.insert(0, things.pop(found))
        value: T = things[0][1]
        return value

    def ask_again(self) -> None:
        """Ask for all that the last round asked for, which is there."""
        self._asked[-1] |= self._last

    def forget_idle(self) -> None:
        """End a round: let go of roles that nobody has asked for in the last rounds."""
        used = set().union(*self._asked)
        self._things = {role: things for role, things in self._things.items() if role in used}
        self._last = self._asked[-1]
        self._asked.append(set())

    def forget_all(self) -> None:
        """Make everything again."""
        self._things.clear()


def same(a: Any, b: Any) -> bool:
    """Equality that compares heads and atlases by identity, without touching their arrays."""
    if a is b:
        return True
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return isinstance(a, int | str | bytes | bool | Plain) and bool(a == b)
