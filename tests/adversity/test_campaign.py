"""The campaign detects what it must detect, and a part of it that takes a minute finds nothing."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from adversity.campaign import Tally, caches, run, tried, tried_again
from adversity.case import (
    ACCEPTED,
    FAILURES,
    HALF_WRITTEN,
    HANG,
    MEMORY,
    NAN,
    REFUSED,
    SIGNAL,
    TRACEBACK,
    UNCLEAR,
    WRONG,
    FoundError,
    Input,
    Plan,
)
from adversity.checks import check_equal, check_finite
from adversity.child import Limits
from adversity.kind import Kind
from adversity.kinds import KINDS, prepare
from adversity.options import options_of_commands
from adversity.report import as_json, as_text
from adversity.trees import changed_tree, json_text, toml_text

from dermis.base.errors import DermisError, refuse

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are watched through /proc")

ROOT = Path(__file__).resolve().parents[2]
_HURRIED = Limits(cpu_s=1.0, stalled_s=0.5)  # for what never ends
_TIGHT = Limits(cpu_s=60.0, stalled_s=60.0, bytes=400 << 20)  # libraries that tests have loaded count
_SEED = 20


def _fails(plan: Plan) -> None:
    raise KeyError("nobody")


def _recurses(plan: Plan) -> None:
    _recurses(plan)


def _spins(plan: Plan) -> None:
    while True:
        pass


def _waits(plan: Plan) -> None:
    sys.stdin.read()


def _reads_a_pipe(plan: Plan) -> None:
    Path("pipe").read_bytes()


def _eats(plan: Plan) -> None:
    held = []
    while True:
        held.append(np.ones(1 << 23))


def _dies(plan: Plan) -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def _is_not_finite(plan: Plan) -> None:
    check_finite({"points": [np.zeros(3), np.array([0.0, np.nan])]}, "head")


def _is_another(plan: Plan) -> None:
    check_equal(np.zeros(3), np.array([0.0, 0.0, -0.0]), "points")


def _leaves_some(plan: Plan) -> None:
    Path("out.png").write_bytes(b"half of a picture")
    refuse("head.obj", "a mesh", "it is none", "Correct it")


def _says_nothing(plan: Plan) -> None:
    raise DermisError("No.")


def _blames_nobody(plan: Plan) -> None:
    refuse("a weight", "a number", "it is none", "Correct it")


def _refuses(plan: Plan) -> None:
    refuse("head.obj", "a mesh", "it is none", "Correct it")


_PLANTED: dict[Callable[[Plan], None], str] = {
    _fails: TRACEBACK,
    _recurses: TRACEBACK,
    _spins: HANG,
    _waits: HANG,
    _reads_a_pipe: HANG,
    _eats: MEMORY,
    _dies: SIGNAL,
    _is_not_finite: NAN,
    _is_another: WRONG,
    _leaves_some: HALF_WRITTEN,
    _says_nothing: UNCLEAR,
    _blames_nobody: UNCLEAR,
    _refuses: REFUSED,
    lambda plan: None: ACCEPTED,
}


def _kind(take: Callable[[Plan], None]) -> Kind:
    return Kind("planted", lambda rng: Input({"head.obj": b"v 0 0 0\n"}, {}), take)


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Import everything, and use one cache for all inputs."""
    with caches(tmp_path_factory.mktemp("cache")):
        prepare()
        yield


@pytest.mark.parametrize(("take", "outcome"), _PLANTED.items(), ids=lambda one: getattr(one, "__name__", one))
def test_planted_faults_are_found(take: Callable[[Plan], None], outcome: str) -> None:
    found = tried(_kind(take), 1, 1, _HURRIED if outcome == HANG else _TIGHT)
    assert found.outcome == outcome, found.last
    assert found.failed is (outcome in FAILURES)


def test_every_failure_can_be_planted() -> None:
    assert set(FAILURES) <= set(_PLANTED.values())


def test_each_failure_is_stored_once_by_location_and_repeated(tmp_path: Path) -> None:
    kinds = {"planted": _kind(_fails)}
    tally = run(kinds, lambda: [("planted", k) for k in range(8)], 1, tmp_path, workers=2)
    ((kind, outcome, place), kept), *others = tally.places.items()
    assert (kind, outcome, others) == ("planted", TRACEBACK, []) and "KeyError" in place
    assert tally.failures == 8 and len(kept) == 3
    assert (tmp_path / kept[0] / "input" / "head.obj").read_bytes().startswith(b"v")
    assert tried_again(kinds, tmp_path / kept[0]).place == place
    assert tried_again({"planted": _kind(_refuses)}, tmp_path / kept[0]).outcome == REFUSED
    assert as_json(tally, 1, 2.0)["places"][0]["kept"] == kept
    assert "8 failures at 1 places" in as_text(tally, 1, 2.0) and kept[0] in as_text(tally, 1, 2.0)


def test_slow_inputs_are_not_failures() -> None:
    marker = Path(os.environ["DERMIS_CACHE"]) / "tried-once"

    def slow_once(plan: Plan) -> None:
        if not marker.exists():
            marker.touch()
            time.sleep(60.0)

    assert tried(_kind(slow_once), 1, 1, Limits(cpu_s=60.0, stalled_s=2.0)).outcome == ACCEPTED


def test_equal_seeds_give_equal_inputs(tmp_path: Path, prepared: None) -> None:
    for name, kind in KINDS.items():
        plans = [kind.make(tmp_path / f"{name}-{k}", _SEED, 3) for k in range(2)]
        files = [_contents(tmp_path / f"{name}-{k}") for k in range(2)]
        assert plans[0] == plans[1] and files[0] == files[1], name
        assert json.loads(json.dumps(plans[0])) == plans[0]


def _contents(folder: Path) -> dict[str, bytes]:
    found = (one for one in folder.rglob("*") if one.is_file())
    return {str(one.relative_to(folder)): one.read_bytes() for one in found}


def test_file_trees_are_written_unchanged() -> None:
    tree = {"a": [1, 2.5, {"b c": "é\n"}], "lights": [{"kind": "spot", "at": [0.0, 1.0]}], "on": True}
    assert json.loads(json_text(tree)) == tree
    assert tomllib.loads(toml_text(tree)) == tree
    changed = [json_text(changed_tree(tree, Random(k))) for k in range(50)]
    assert len(set(changed) - {json_text(tree)}) > 40


def test_all_options_of_all_commands_are_tried() -> None:
    from dermis.cli import COMMANDS

    known = options_of_commands()
    assert set(known) == set(COMMANDS)
    names = {name for options in known.values() for one in options for name in one.names}
    assert {"HEAD", "-o", "--size", "--pose", "--through", "--crf", "--host", "--scene"} <= names


@pytest.fixture(scope="module")
def part() -> Any:
    """Return the results of a fixed part of the campaign, in a process without a device."""
    ended = _program("adversity.part", "--seed", str(_SEED))
    return json.loads(ended.stdout)


@pytest.mark.parametrize("name", KINDS)
def test_sound_inputs_are_accepted_and_damaged_ones_do_no_harm(name: str, part: Any) -> None:
    assert part[name]["sound"] == ACCEPTED, part[name]["last"]
    assert part[name]["failures"] == 0 and part[name]["inputs"] > 0, part[name]["text"]


def _program(module: str, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", f"tests.{module}", *words]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended


def test_campaign_runs_as_a_program(tmp_path: Path) -> None:
    words = ["--minutes", "0.02", "--only", "frames", "--json", "--keep", str(tmp_path), "--workers", "1"]
    ended = _program("adversity", *words)
    told = json.loads(ended.stdout)
    assert told["failures"] == 0 and told["inputs"] == sum(told["kinds"]["frames"].values()) > 0


def test_a_tally_counts_only_failures() -> None:
    tally = Tally()
    for take in (_fails, _refuses):
        tally.add(tried(_kind(take), 1, 1))
    assert tally.failures == 1 and tally.counts["planted"] == {TRACEBACK: 1, REFUSED: 1}


def test_each_result_has_an_outcome() -> None:
    assert FoundError(NAN, "points").outcome in FAILURES
