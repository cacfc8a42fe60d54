"""Native decoders run in a process of their own, whose faults become refusals."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from dermis.base import native_decoding
from dermis.base.errors import DermisError
from dermis.base.native_decoding import run_decoder, text_from_array

MODULE = "looping_decoder"


def answer_to(request: str) -> dict[str, np.ndarray]:
    return run_decoder(MODULE, {request: np.arange(3)}, 1000, "a.x", "a file")


@pytest.fixture(autouse=True)
def _tests_are_importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    monkeypatch.setattr(native_decoding, "_BASE_CPU_LIMIT_S", 1.0)


def test_arrays_pass_through_the_decoder_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "json.py").write_text("raise SystemExit(1)")  # a hostile file in the working directory
    monkeypatch.chdir(tmp_path)
    answer = answer_to("sound")
    np.testing.assert_array_equal(answer["sound"], np.arange(3))
    assert str(tmp_path) not in text_from_array(answer["path"]).split("\n") and "" not in answer


@pytest.mark.skipif(sys.platform != "linux", reason="other systems limit less")
@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("crash", "a.x: expected a file, but its decoder stopped .signal 11"),
        ("loop", "a.x: expected a file, but its decoder (stopped .signal|takes more)"),
        ("memory", "a.x: expected a file, but it cannot be decoded .*Memory"),
        ("fail", "a.x: expected a file, but it cannot be decoded .KeyError: 'lost'.*damaged"),
        ("refuse", "^a.x: expected one, but it has two. Remove it.$"),
    ],
)
def test_decoder_errors_become_refusals(fault: str, message: str) -> None:
    with pytest.raises(DermisError, match=message):
        answer_to(fault)


def test_stalled_decoder_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native_decoding, "_MAX_WAIT_PER_CPU_TIME", 0.01)
    with pytest.raises(DermisError, match="its decoder takes more than 1 s"):
        answer_to("loop")


def test_an_answer_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native_decoding, "_MAX_ANSWER_BYTES", 100)
    with pytest.raises(DermisError, match=r"its decoder stopped .its answer is too large"):
        answer_to("sound")
