"""Distribution of workers over GPUs, by the number of each worker on its host."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from dermis.apps.batch import worker_pool
from dermis.apps.batch.dask_worker import reserve_local_rank
from dermis.apps.batch.worker_pool import SlotRequest


def patch_machine(monkeypatch: pytest.MonkeyPatch, cores: int, kind: str, *numbers: int) -> None:
    found = [SimpleNamespace(kind=kind, number=number) for number in numbers]
    by_name: dict[str, Any] = {f"#{one.number}": [one] for one in found} | {"auto": found}
    monkeypatch.setattr(worker_pool, "adapters_like_best_match", by_name.__getitem__)
    monkeypatch.setattr(worker_pool, "available_cores", lambda: cores)


def slot_adapters(request: SlotRequest) -> list[str]:
    return [slot.adapter for slot in request.worker_slots()[0]]


def test_each_gpu_has_a_worker_or_several(monkeypatch: pytest.MonkeyPatch) -> None:
    patch_machine(monkeypatch, 16, "DiscreteGPU", 0, 1)
    assert slot_adapters(SlotRequest()) == ["#0", "#1"]
    assert slot_adapters(SlotRequest(workers_per_gpu=2)) == ["#0", "#1", "#0", "#1"]
    assert slot_adapters(SlotRequest(workers=3)) == ["#0", "#1", "#0"]
    assert slot_adapters(SlotRequest(numbers=(1,))) == ["#1"]


@pytest.mark.parametrize(("workers", "encoders"), [(1, 7), (2, 3), (8, 1), (16, 1)])
def test_encoders_share_the_cores(monkeypatch: pytest.MonkeyPatch, workers: int, encoders: int) -> None:
    patch_machine(monkeypatch, 8, "DiscreteGPU", 0)
    found, each = SlotRequest(workers=workers).worker_slots()
    assert each == encoders and all(slot.threads == 0 for slot in found)
    assert SlotRequest(workers=workers, encoders=5).worker_slots()[1] == 5


@pytest.mark.parametrize(("cores", "workers", "threads"), [(1, 1, 1), (2, 1, 2), (8, 4, 2)])
def test_a_software_adapter_shares_the_cores(
    monkeypatch: pytest.MonkeyPatch, cores: int, workers: int, threads: int
) -> None:
    patch_machine(monkeypatch, cores, "CPU", 0)
    found, encoders = SlotRequest().worker_slots()
    assert (len(found), found[0].threads, encoders) == (workers, threads, 0)


def test_ranks_of_a_host_are_its_own_and_free_again() -> None:
    with reserve_local_rank() as first, reserve_local_rank() as second:
        assert (first, second) == (0, 1)
    with reserve_local_rank() as again:
        assert again == 0
