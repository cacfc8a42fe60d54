"""Fields of a spec that hold distributions, with what these may reach."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from dermis.apps.batch.distributions import Constant, Distribution
from dermis.apps.batch.stated import stated

_REACH = "; normal reaches to 6 sd either way, truncated to its ends"


class Anything:
    """For pydantic: `Annotated[Distribution, Anything()]` is read from what a spec states."""

    def check(self, told: Any) -> Distribution | None:
        """The distribution; None for a field that is left out.

        Raises ValueError for what is none, and for one that reaches too far, worded as expected.
        """
        if told is None:
            return None
        found = stated(told)
        self.check_ends(found)
        return found

    def check_ends(self, found: Distribution) -> None:
        """Raises ValueError for values that the field cannot have."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        def told(value: Distribution | None) -> Any:
            return None if value is None else value.told()

        serialised = core_schema.plain_serializer_function_ser_schema(told)
        return core_schema.no_info_plain_validator_function(self.check, serialization=serialised)


class Within(Anything):
    """Numbers between two bounds.

    why : the reason of the bounds
    """

    def __init__(self, low: float, high: float, why: str = "") -> None:
        self.ge, self.le, self.why = low, high, why

    def check_ends(self, found: Distribution) -> None:
        if any(isinstance(end, str) or not self.ge <= end <= self.le for end in found.ends):
            why = f" ({self.why})" if self.why else ""
            reach = "" if isinstance(found, Constant) else _REACH
            raise ValueError(f"numbers from {self.ge:.10g} to {self.le:.10g}{why}{reach}")


class OneOf(Anything):
    """Names: of some where they are known, else any, those of files too."""

    def __init__(self, known: Callable[[], Iterable[str]] | None = None) -> None:
        self.known = known

    def check_ends(self, found: Distribution) -> None:
        names = list(self.known()) if self.known else []
        for end in found.ends:
            if not isinstance(end, str) or (names and end not in names):
                raise ValueError(f"one of {', '.join(names)}" if names else "a name, or a choice of names")
        if names and not found.ends:
            raise ValueError(f"one of {', '.join(names)}, no files")
