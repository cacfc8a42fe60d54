"""Kinds of input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random

from adversity.case import Input, Plan
from adversity.damage import damaged


@dataclass(frozen=True)
class Kind:
    """Kind of input.

    sound : returns an input that the package accepts
    take : processes it in a separate process, in the folder of the files; raises DermisError if the package
        refuses it and `FoundError` if the result is wrong
    change : damages an input
    share : number of inputs of this kind in each round of a campaign
    cpu_s : CPU time for one input [s]
    opens_device : whether it opens a device, which the process that others are forked from must not
    warmed : number of valid inputs that are processed first: all that it can begin with
    """

    name: str
    sound: Callable[[Random], Input]
    take: Callable[[Plan], None]
    change: Callable[[Input, Random], Input] = damaged
    share: int = 10
    cpu_s: float = 10.0
    opens_device: bool = False
    warmed: int = 24

    def make(self, folder: Path, seed: int, number: int) -> Plan:
        """Write the files of an input to a folder and return its plan."""
        rng = Random(f"{self.name} {seed} {number}")
        return self.change(self.sound(rng), rng).write(folder)
