"""Bind groups kept from frame to frame."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any

Key = tuple[int, ...]


class BindGroups:
    """A program's bind groups by the identity of all that they bind.

    A group lets go of its resources' memory only when it goes itself, so it is forgotten as soon as one of
    them is no longer held elsewhere.
    """

    def __init__(self) -> None:
        self._groups: dict[Key, Any] = {}
        self._users: dict[int, tuple[weakref.ref[Any], set[Key]]] = {}

    def __len__(self) -> int:
        return len(self._groups)

    @property
    def followed(self) -> int:
        """How many resources the groups bind."""
        return len(self._users)

    def find(self, key: Key) -> Any:
        """The group of a key from `key_of`, None when there is none (any more)."""
        return self._groups.get(key)

    def keep(self, key: Key, resources: Sequence[Any], group: Any) -> None:
        """Keep the group for as long as all the resources that gave the key live."""
        self._groups[key] = group
        for resource in resources:
            self._user(resource).add(key)

    def _user(self, resource: Any) -> set[Key]:
        """The keys in which a resource is; new ones are followed to their end."""
        name = id(resource)
        if name not in self._users:
            this = weakref.ref(self)

            def gone(_: Any) -> None:
                groups = this()
                if groups is not None:  # they may be none, and the resource still be followed
                    groups._forget(name)

            self._users[name] = weakref.ref(resource, gone), set()
        return self._users[name][1]

    def _forget(self, name: int) -> None:
        _, keys = self._users.pop(name)
        for key in keys:
            self._groups.pop(key, None)
            for other in set(key) & self._users.keys():
                self._users[other][1].discard(key)


def key_of(resources: Sequence[Any]) -> Key:
    """What tells a program's group for these resources from its others."""
    return tuple(map(id, resources))
