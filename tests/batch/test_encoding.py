"""Encoder processes: results, order, and errors when one of them dies."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import closing

import numpy as np
import pytest

from dermis.apps.batch.child_processes import LostProcessError
from dermis.apps.batch.encoder_pool import EncoderPool
from dermis.base.errors import DermisError


def encode(number: int, array: np.ndarray) -> tuple[int, dict[str, bytes]]:
    if number == 90:
        os.kill(os.getpid(), signal.SIGKILL)
    if number == 80:
        raise DermisError("image 80 cannot be encoded")
    return number, {"raw": array.tobytes(), "pid": str(os.getpid()).encode()}


def jobs(*numbers: int) -> Iterator[tuple[int, np.ndarray]]:
    for number in numbers:
        size = 50 if number < 6 else 200_000  # later ones need more memory
        yield number, np.full((size, 3), number, np.float32)[:, ::2]


def test_order_and_bytes_do_not_depend_on_the_number_of_processes() -> None:
    numbers = range(9)
    with closing(EncoderPool(0, encode)) as here, closing(EncoderPool(2, encode)) as there:
        expected, found = list(here.encode_all(jobs(*numbers))), list(there.encode_all(jobs(*numbers)))
    assert [(number, one["raw"]) for number, one in found] == [
        (number, one["raw"]) for number, one in expected
    ]
    pids = {one["pid"] for _, one in found}
    assert str(os.getpid()).encode() not in pids and len(pids) >= 2


def test_only_a_few_jobs_are_read_ahead() -> None:
    started: list[int] = []

    def counted_jobs() -> Iterator[tuple[int, np.ndarray]]:
        for job in jobs(*[1] * 20):
            started.append(1)
            yield job

    with closing(EncoderPool(1, encode)) as encoders:
        found = encoders.encode_all(counted_jobs())
        next(found)
        assert len(started) <= 4
        found.close()  # type: ignore[attr-defined]
        assert [number for number, _ in encoders.encode_all(jobs(1, 2))] == [1, 2]


@pytest.mark.skipif(os.name != "posix", reason="signals are POSIX's")
def test_a_dead_encoder_is_reported_and_replaced() -> None:
    with closing(EncoderPool(1, encode)) as encoders:
        with pytest.raises(LostProcessError, match="SIGKILL"):
            list(encoders.encode_all(jobs(1, 90, 2)))
        with pytest.raises(DermisError, match="image 80"):
            list(encoders.encode_all(jobs(1, 80, 2)))
        assert [number for number, _ in encoders.encode_all(jobs(1, 2))] == [1, 2]
