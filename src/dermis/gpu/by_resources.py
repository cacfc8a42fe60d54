"""A cache keyed by resources: an entry is dropped as soon as one of its resources is released."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

Key = tuple[int, ...]
T = TypeVar("T")


class ByResources(Generic[T]):
    """Bind groups and the like, keyed by the identity of the resources that they bind.

    A bind group keeps its resources' memory alive, so it is dropped as soon as one of them is no longer held
    elsewhere.
    """

    def __init__(self) -> None:
        self._kept: dict[Key, T] = {}
        self._users: dict[int, tuple[weakref.ref[Any], set[Key]]] = {}

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def followed(self) -> int:
        """Number of resources that entries depend on."""
        return len(self._users)

    def find(self, key: Key) -> T | None:
        """The entry for a key from `key_of`, None without one."""
        return self._kept.get(key)

    def keep(self, key: Key, resources: Sequence[Any], made: T) -> None:
        """Keep an entry for as long as all of its key's resources live."""
        self._kept[key] = made
        for resource in resources:
            self._user(resource).add(key)

    def _user(self, resource: Any) -> set[Key]:
        """The keys that contain a resource; new resources are watched until they are released."""
        name = id(resource)
        if name not in self._users:
            this = weakref.ref(self)

            def gone(_: Any) -> None:
                kept = this()
                if kept is not None:
                    kept._forget(name)

            self._users[name] = weakref.ref(resource, gone), set()
        return self._users[name][1]

    def _forget(self, name: int) -> None:
        _, keys = self._users.pop(name)
        for key in keys:
            self._kept.pop(key, None)
            for other in set(key) & self._users.keys():
                self._users[other][1].discard(key)


def key_of(resources: Sequence[Any]) -> Key:
    """The key for these resources in this order."""
    return tuple(map(id, resources))
