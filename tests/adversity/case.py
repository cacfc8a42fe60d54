"""One input: how it is made and read by the package, and its outcome."""

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
    """Error for a result that is not as it must be."""

    def __init__(self, outcome: str, what: str) -> None:
        super().__init__(what)
        self.outcome = outcome


@dataclass(frozen=True)
class Input:
    """Files, and what is done with them.

    files : bytes by name
    plan : JSON for the `take` function of the kind; "error_subjects": names of which messages must contain
        one, instead of those of the files; "outputs": prefixes of files that may be written; "kept": those
        that may remain after a refusal
    changed : files to damage; all if empty
    """

    files: Mapping[str, bytes]
    plan: Plan
    changed: tuple[str, ...] = ()

    def write(self, folder: Path) -> Plan:
        """Write the files to a folder and return the plan."""
        for name, data in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        return {"error_subjects": list(self.files)} | dict(self.plan)


@dataclass(frozen=True)
class Outcome:
    """Outcome of an input.

    kind, seed, number : identification of the input
    outcome : "accepted", "refused" or one of `FAILURES`
    place : location of the error, or the outcome alone, by which equal failures are recognised
    last : last lines that were printed
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
        """Return whether the package is at fault."""
        return self.outcome in FAILURES
