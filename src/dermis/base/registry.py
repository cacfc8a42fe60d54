"""Things that can be chosen by name: techniques, lights, lobes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import Any, Generic, TypeVar, cast

from dermis.base.errors import refuse

T = TypeVar("T")


class Registry(Mapping[str, T], Generic[T]):
    """Entries of one kind by name, in the order in which they were registered.

    An entry is the object itself, or "module:attribute" for one that is imported on first use.

    changes : how often entries have been added or taken away
    """

    def __init__(
        self, kind: str, entries: Mapping[str, T | str] | None = None, advice: str = "Correct it"
    ) -> None:
        """kind : what an entry is, for messages: "technique", say

        advice : what to do about a name that is not registered
        """
        self.kind, self.advice = kind, advice
        self.changes = 0
        self._entries: dict[str, T | str] = dict(entries or {})
        self._summaries: dict[str, str] = {}

    def register(self, name: str, entry: T | str, summary: str = "") -> None:
        """Add an entry, from inside the package or outside of it.

        summary : what the name stands for, in a few words for the help texts

        Raises DermisError when the name is taken.
        """
        if name in self._entries:
            refuse(
                f"{self.kind} {name}", "a name of its own", "it is registered already", "Choose another name"
            )
        self._entries[name] = entry
        self.changes += 1
        if summary:
            self._summaries[name] = summary

    @contextmanager
    def including(self, name: str, entry: T | str) -> Iterator[None]:
        """While it lasts, an entry more."""
        self.register(name, entry)
        try:
            yield
        finally:
            self.remove(name)

    def remove(self, name: str) -> None:
        """Take an entry out again; nothing happens when it is not there."""
        self._entries.pop(name, None)
        self._summaries.pop(name, None)
        self.changes += 1

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all entries."""
        return tuple(self._entries)

    def summaries(self) -> list[str]:
        """What each name stands for, of those that say so: "name: summary"."""
        return [f"{name}: {summary}" for name, summary in self._summaries.items()]

    def __getitem__(self, name: str) -> T:
        """Raises DermisError for a name that is not registered."""
        entry = self._entries.get(name)
        if entry is None:
            refuse(self.kind, f"one of {', '.join(self._entries)}", f"{name!r} came", self.advice)
        if isinstance(entry, str):
            module, _, attribute = entry.partition(":")
            entry = self._entries[name] = cast(T, getattr(import_module(module), attribute))
        return entry

    def __contains__(self, name: object) -> bool:
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)


class Named:
    """For pydantic: `Annotated[str, Named(REGISTRY)]` is a name that is registered when it is checked."""

    def __init__(self, registry: Registry[Any], *others: str) -> None:
        """others : words that the value may be besides, "none", say"""
        self.registry, self.others = registry, others

    @property
    def names(self) -> tuple[str, ...]:
        """All that the value may be."""
        return (*self.registry, *self.others)

    def check(self, name: str) -> str:
        """The name itself.

        Raises ValueError for one that is neither registered nor one of the others, worded as expected.
        """
        if name not in self.names:
            raise ValueError(f"one of {', '.join(self.names)}")
        return name

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core.core_schema import no_info_after_validator_function

        return no_info_after_validator_function(self.check, handler(source))
