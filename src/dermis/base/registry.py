"""Registries: objects that users choose by name, such as techniques, lights and lobes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import Any, Generic, TypeVar, cast

from dermis.base.errors import refuse

T = TypeVar("T")


class Registry(Mapping[str, T], Generic[T]):
    """Mapping from names to objects of one kind, in the order of registration.

    An entry is the object itself, or a text "module:attribute"; the object is then imported on first use.

    Parameters
    ----------
    entry_noun : str
        What an entry is, for error messages, such as "technique".
    entries : Mapping of str to object or str, optional
        Initial entries: a mapping from name to entry.
    advice : str, optional
        What to do about a name that is not registered, for error messages.

    Attributes
    ----------
    changes : int
        Number of entries added or removed since the registry was created.

    Examples
    --------
    >>> shapes = Registry("shape", {"square": 4})
    >>> shapes.register("triangle", 3, "three corners")
    >>> shapes["triangle"], shapes.names, shapes.summaries()
    (3, ('square', 'triangle'), ['triangle: three corners'])
    """

    def __init__(
        self, entry_noun: str, entries: Mapping[str, T | str] | None = None, advice: str = "Correct it"
    ) -> None:
        self.kind, self.advice = entry_noun, advice
        self.changes = 0
        self._entries: dict[str, T | str] = dict(entries or {})
        self._summaries: dict[str, str] = {}

    def register(self, name: str, entry: T | str, summary: str = "") -> None:
        """Add an entry; other packages may also add entries.

        Parameters
        ----------
        name : str
            Name that users write.
        entry : object or str
            The object, or "module:attribute".
        summary : str, optional
            Description in a few words, for help texts.

        Raises
        ------
        DermisError
            The name is already registered.
        """
        if name in self._entries:
            refuse(f"{self.kind} {name}", "an unused name", "it is already registered", "Choose another name")
        self._entries[name] = entry
        self.changes += 1
        if summary:
            self._summaries[name] = summary

    @contextmanager
    def temporary_entry(self, name: str, entry: T | str) -> Iterator[None]:
        """Add an entry for the duration of a with block, such as in tests."""
        self.register(name, entry)
        try:
            yield
        finally:
            self.remove(name)

    def remove(self, name: str) -> None:
        """Remove the entry with a name; do nothing if the name is not registered."""
        self._entries.pop(name, None)
        self._summaries.pop(name, None)
        self.changes += 1

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of all entries."""
        return tuple(self._entries)

    def summaries(self) -> list[str]:
        """Return "name: summary" for each entry that has a summary, for help texts."""
        return [f"{name}: {summary}" for name, summary in self._summaries.items()]

    def __getitem__(self, name: str) -> T:
        """Return the object of an entry; an object given as "module:attribute" is imported on first use.

        Raises DermisError for a name that is not registered.
        """
        entry = self._entries.get(name)
        if entry is None:
            refuse(self.kind, f"one of {', '.join(self._entries)}", f"got {name!r}", self.advice)
        if isinstance(entry, str):
            module, _, attribute = entry.partition(":")
            entry = self._entries[name] = cast(T, getattr(import_module(module), attribute))
        return entry

    def __contains__(self, name: object) -> bool:
        """Return whether a name is registered, without importing the object."""
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        """Return an iterator over the names."""
        return iter(self._entries)

    def __len__(self) -> int:
        """Return the number of entries."""
        return len(self._entries)


class RegisteredName:
    """Pydantic annotation: `Annotated[str, RegisteredName(REGISTRY)]` accepts registered names only.

    Parameters
    ----------
    registry : Registry
        Registry whose names are accepted, including names registered later.
    *words : str
        Words that are accepted in addition, such as "none".
    """

    def __init__(self, registry: Registry[Any], *words: str) -> None:
        self.registry, self.words = registry, words

    @property
    def names(self) -> tuple[str, ...]:
        """Return all accepted names: those in the registry, then the words that are accepted in addition."""
        return (*self.registry, *self.words)

    def check(self, name: str) -> str:
        """Return the name if it is accepted, else raise ValueError."""
        if name not in self.names:
            raise ValueError(f"one of {', '.join(self.names)}")
        return name

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Return the schema of the annotated type, extended by a call of `check`."""
        from pydantic_core.core_schema import no_info_after_validator_function

        return no_info_after_validator_function(self.check, handler(source))
