"""What workers tell while they draw."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.apps.batch.shards import Shard
from dermis.apps.batch.worker import Failure


@dataclass(frozen=True)
class Told:
    """One of these at a time.

    images : that were drawn since the last time
    shard : that is whole now
    failed : images that were left out of it
    note : for who waits
    again : why the worker ends, and its shard is drawn by another
    refusal : why the run ends
    """

    images: int = 0
    shard: Shard | None = None
    failed: tuple[Failure, ...] = ()
    note: str = ""
    again: str = ""
    refusal: str = ""
