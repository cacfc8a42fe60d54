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
    """A kind of input.

    sound : an input that the package takes
    take : does so in a process of its own, in the folder of the files; raises DermisError where the package
        refuses, `FoundError` where the result is not as it must be
    change : damages an input
    share : inputs of this kind in each round of a campaign
    cpu_s : time for one on processors [s]
    opens_device : whether it may, which the process that others are forked from must not
    """

    name: str
    sound: Callable[[Random], Input]
    take: Callable[[Plan], None]
    change: Callable[[Input, Random], Input] = damaged
    share: int = 10
    cpu_s: float = 10.0
    opens_device: bool = False

    def make(self, folder: Path, seed: int, number: int) -> Plan:
        """Write an input's files into a folder; its plan."""
        rng = Random(f"{self.name} {seed} {number}")
        return self.change(self.sound(rng), rng).write(folder)
