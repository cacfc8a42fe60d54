"""One input: how it is made, taken in by the package, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ACCEPTED, REFUSED = "accepted", "refused"
TRACEBACK, UNCLEAR, HANG, MEMORY, SIGNAL = "traceback", "unclear refusal", "hang", "over memory", "signal"
NAN, WRONG, HALF_WRITTEN = "NaN", "wrong", "half-written"
FAILURES = (TRACEBACK, UNCLEAR, HANG, MEMORY, SIGNAL, NAN, WRONG, HALF_WRITTEN)

Plan = dict[str, Any]
"""What is done with an input besides its files, as JSON."""


class FoundError(Exception):
    """What was made of an input is not as it must be."""

    def __init__(self, outcome: str, what: str) -> None:
        super().__init__(what)
        self.outcome = outcome


@dataclass(frozen=True)
class Input:
    """Files, and what is done with them.

    files : bytes by name
    plan : for the kind's `take`, as JSON; what messages must name one of under "culprits", the files where it
        is not there; how names begin that may be written under "outputs", and that may stay after a refusal
        under "kept"
    changed : files that are to be damaged, all where empty
    """

    files: Mapping[str, bytes]
    plan: Plan
    changed: tuple[str, ...] = ()

    def write(self, folder: Path) -> Plan:
        """Put the files into a folder; the plan."""
        for name, data in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        return {"culprits": list(self.files)} | dict(self.plan)


@dataclass(frozen=True)
class Outcome:
    """What came of an input.

    kind, seed, number : which it is
    outcome : "accepted", "refused" or one of `FAILURES`
    place : by which equal failures are told: where it was raised, or the outcome alone
    last : the last lines that it printed
    """

    kind: str
    seed: int
    number: int
    outcome: str
    place: str = ""
    last: str = ""
    plan: Plan = field(default_factory=dict)

    @property
    def failed(self) -> bool:
        """Whether the package is at fault."""
        return self.outcome in FAILURES
