"""A fixed part of the campaign: `python -m tests.adversity.part --seed 20` prints its results as JSON."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # as pytest has it

from adversity.campaign import caches, run, tried
from adversity.kinds import KINDS, prepare
from adversity.report import as_text

_IN_EACH = 8  # inputs of each kind
_FEW = {"options": 4, "drawn": 2, "large": 2, "viewer": 1}  # of those that take seconds


def main() -> None:
    """Run a valid input and some damaged ones of each kind."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    seed = parser.parse_args().seed
    with tempfile.TemporaryDirectory() as folder, caches(Path(folder) / "cache"):
        prepare()
        print(json.dumps({name: _found(name, seed, Path(folder)) for name in KINDS}))


def _found(name: str, seed: int, folder: Path) -> dict[str, Any]:
    kind = KINDS[name]
    sound = tried(replace(kind, change=lambda one, rng: one), seed, 0)
    jobs = [(name, number) for number in range(_FEW.get(name, _IN_EACH))]
    tally = run({name: kind}, lambda: jobs, seed, folder)
    told = {"inputs": len(jobs), "failures": tally.failures, "text": as_text(tally, seed, 0.0)}
    return {"sound": sound.outcome, "last": sound.last, **told}


if __name__ == "__main__":
    main()
