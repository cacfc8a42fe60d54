"""Test random damage to all kinds of input that the package reads: `python -m tests.adversity --minutes 60`.

Each input is read by a separate process under limits of time and memory. It must be refused with the
package's form of message, or accepted with a finite and correct result. Failures are stored with everything
needed to repeat them with `--replay`. The exit status is 1 if there were any.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # as pytest has it

from adversity.campaign import Tally, caches, rounds, run, tried_again
from adversity.kinds import KINDS, prepare
from adversity.report import as_json, as_text

_TOLD_S = 30.0


def main() -> int:
    """Run a campaign, or repeat one of its inputs."""
    told = _arguments()
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, caches(Path(folder)):
        if told.replay:
            outcome = tried_again(KINDS, told.replay)
            print(f"{outcome.kind}: {outcome.outcome}: {outcome.place}\n{outcome.last}")
            return int(outcome.failed)
        chosen = {name: KINDS[name] for name in told.only or KINDS}
        prepare(chosen)
        until = time.monotonic() + 60 * told.minutes
        progress = _Progress(began)
        tally = run(
            chosen, lambda: rounds(chosen, until), told.seed, told.keep, told.workers, told=progress.note
        )
    seconds = time.monotonic() - began
    print(json.dumps(as_json(tally, told.seed, seconds)) if told.json else as_text(tally, told.seed, seconds))
    return int(tally.failures > 0)


class _Progress:
    """Progress lines on standard error at intervals."""

    def __init__(self, began: float) -> None:
        self._began = self._last = began

    def note(self, tally: Tally) -> None:
        """Print the progress."""
        now = time.monotonic()
        if now - self._last > _TOLD_S:
            self._last = now
            count = sum(sum(one.values()) for one in tally.counts.values())
            place = f"{tally.failures} failures at {len(tally.places)} places"
            print(f"{now - self._began:.0f} s: {count} inputs, {place}", file=sys.stderr)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.adversity", description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", action="append", choices=sorted(KINDS), help="a kind of input, repeatable")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--keep", type=Path, default=Path("out/adversity"), help="folder for failures")
    parser.add_argument("--replay", type=Path, help="a failure's folder, to try its input again")
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
