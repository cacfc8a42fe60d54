"""A cache of what the CPU makes for frames: uploaded maps, fitted tables, textures to write to."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, TypeVarTuple, overload

import numpy as np

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
Role = tuple[Callable[..., object], str]


@dataclass(eq=False, slots=True)
class Made:
    """What a function returned for some arguments.

    parts : what was kept while it was made, which is in use as long as this is
    roles : its own and those of all its parts
    """

    args: tuple[object, ...]
    value: Any = None  # of the type that the function returns
    parts: list[tuple[Role, Made]] = field(default_factory=list)
    roles: set[Role] = field(default_factory=set)


class Memo:
    """Results of functions by their arguments; a function is called again only when an argument changes.

    depth : how many results of each function are kept, for callers that alternate between a few
    rounds : after which a function is forgotten that nobody asked for; depth squared where that is more
    """

    def __init__(self, depth: int = 1, rounds: int = 1) -> None:
        self._depth = depth
        self._kept: dict[Role, list[Made]] = {}
        self._asked: deque[set[Role]] = deque([set()], maxlen=max(rounds, depth * depth))
        self._making: list[Made] = []
        self._found: list[tuple[Role, Made]] = []  # in this round, parts not among them

    @overload
    def keep(self, make: Callable[[*Ts], T], *args: *Ts, of: str = "") -> T: ...

    @overload
    def keep(self, make: Callable[..., T], *args: object, using: tuple[object, ...], of: str = "") -> T: ...

    def keep(self, make: Callable[..., T], *args: object, using: tuple[object, ...] = (), of: str = "") -> T:
        """What `make(*args, *using)` returned, made unless these are among the arguments used last.

        using : what it also takes, and what makes no other result where the arguments are the same
        of : whose it is, where several are in use in turn
        """
        role = make, of
        kept = self._kept.setdefault(role, [])
        found = None
        for one in kept:
            if same(one.args, args):
                found = one
                break
        if found is not None:
            found.args = args  # equal ones may be others: from now on these are recognised at once
        else:
            self._settle(role)
            kept[:] = kept[: self._depth - 1]  # before making, which may need the space
            found = self._made(make, args, using)
            found.roles.add(role)
            self._touch(role, found)
        if self._making:
            self._making[-1].parts.append((role, found))
            self._making[-1].roles |= found.roles
            self._touch(role, found)
        else:
            self._found.append((role, found))
        value: T = found.value
        return value

    def soon(self, executor: Executor, make: Callable[[*Ts], T], *args: *Ts, of: str = "") -> Future[T]:
        """What `make(*args)` returns, begun on another thread unless it is kept; for `wait`."""
        return self.keep(_begin, executor, make, args, of=of)

    def wait(self, begun: Future[T]) -> T:
        """What was begun, as soon as it is there."""
        try:
            return begun.result()
        except Exception:
            self.forget()  # what failed must not be found again
            raise

    def end(self) -> None:
        """End a round: let go of what nobody has asked for in the last rounds."""
        if self._depth > 1:
            self._settle()
        self._asked[-1].update(*(made.roles for _, made in self._found))
        self._found.clear()
        used = set().union(*self._asked)
        if len(used) < len(self._kept):
            self._kept = {role: kept for role, kept in self._kept.items() if role in used}
        self._asked.append(set())

    def forget(self) -> None:
        """Make everything again."""
        self._kept.clear()
        self._found.clear()

    def _made(self, make: Callable[..., object], args: tuple[object, ...], using: tuple[object, ...]) -> Made:
        made = Made(args)
        self._making.append(made)
        try:
            made.value = make(*args, *using)
        finally:
            self._making.pop()
        return made

    def _settle(self, among: Role | None = None) -> None:
        """Let what this round has found be what was used last, where others are to go."""
        for role, made in self._found:
            if among is None or among in made.roles:
                self._touch(role, made)

    def _touch(self, role: Role, made: Made) -> None:
        """It and its parts are what was used last."""
        self._asked[-1].add(role)
        kept = self._kept.setdefault(role, [])
        if not kept or kept[0] is not made:
            kept[:] = [made, *(one for one in kept if one is not made)][: self._depth]
        for part in made.parts:
            self._touch(*part)


def _begin(executor: Executor, make: Callable[[*Ts], T], args: tuple[*Ts]) -> Future[T]:
    return executor.submit(make, *args)


def same(a: Any, b: Any) -> bool:
    """Equality of values by what they say, arrays and dataclasses included; of other things by identity."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, tuple | list):
        if len(a) != len(b):
            return False
        for x, y in zip(a, b, strict=True):  # noqa: SIM110 most are the very same: no call for these
            if x is not y and not same(x, y):
                return False
        return True
    if isinstance(a, np.ndarray):
        return bool(a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes())
    if not is_value(a):
        return False
    kind: Any = type(a)  # mypy takes no type of Any for hashable
    names = field_names(kind)
    if names is None:
        return bool(a == b)
    for name in names:
        x, y = getattr(a, name), getattr(b, name)
        if x is not y and not same(x, y):
            return False
    return True


@cache
def field_names(kind: type) -> tuple[str, ...] | None:
    """Of a dataclass; kept by kind, as others are slow to say that they are none."""
    return tuple(one.name for one in fields(kind)) if is_dataclass(kind) else None


def is_value(thing: object) -> bool:
    """Whether it stands for what it says, and not for itself as textures do."""
    return type(thing).__eq__ is not object.__eq__
