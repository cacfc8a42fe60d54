"""A data set that renders quickly: a ball of two sizes, seen from around."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path

from small_head import obj_text

from dermis.apps.batch.run import RunReport, run
from dermis.apps.batch.shards import Shard
from dermis.apps.batch.spec import Spec, load_spec
from dermis.apps.batch.worker import RunOptions, Worker, WorkerEvent, WorkerSlot
from dermis.apps.batch.worker_pool import ProcessPool

COUNT, SHARD_SIZE = 50, 20
SHARDS = 3
PARTS = (0, 16), (16, 20), (20, 32), (32, 40), (40, 48), (48, 50)
"""First image of each part, and the one after its last."""
HERE = WorkerSlot("cpu", 1)
_TEXT = f"""
count = {COUNT}
seed = 3
size = [32, 32]
shard_size = {SHARD_SIZE}
outputs = ["depth", "normal"]
landmarks = ["points.csv"]

[render]
atlas = 64
samples = 1
shadow_size = 64
transmission = "none"

[person]
head = {{choice = ["head.obj", "large.obj"]}}

[gaze]
at = "angles"

[camera]
yaw_deg = {{uniform = [-90, 90]}}
"""


def write_spec(folder: Path, *bad: str) -> Path:
    """Write the spec and its heads to a folder.

    bad : names of heads that cannot be read, which some images show
    """
    (folder / "head.obj").write_text(obj_text())
    larger = re.sub(r"(?m)^v (\S+)", lambda match: f"v {float(match[1]) * 1.3:.6g}", obj_text())
    (folder / "large.obj").write_text(larger)
    for name in bad:
        (folder / name).write_text("no head\n")
    (folder / "points.csv").write_text("name,vertex\nfirst,0\nsecond,1\n")
    path = folder / "spec.toml"
    listed = "".join(f', "{name}"' for name in bad)
    path.write_text(_TEXT.replace('"large.obj"]', f'"large.obj"{listed}]'))
    return path


def read(path: Path) -> Spec:
    return load_spec(path)


def drawn(spec: Spec, out: Path, workers: int = 1, encoders: int = 0, **more: object) -> RunReport:
    """Run to the end with worker processes."""
    keep_going = bool(more.pop("keep_going", False))
    return run(RunOptions(spec, out, encoders, keep_going), ProcessPool([HERE] * workers), **more)  # type: ignore[arg-type]


class ThisProcess:
    """Pool with one worker in this process, which starts in less time than a process."""

    def render(self, options: RunOptions, tasks: Sequence[Shard]) -> Iterator[WorkerEvent]:
        """Process the tasks in order, and yield the events of each when it is done."""
        queue = deque(tasks)
        with closing(Worker(HERE.adapter, options)) as worker:
            while queue:
                events: list[WorkerEvent] = []
                worker.run_tasks([queue.popleft()], events.append)
                for event in events:
                    queue.extendleft(reversed(event.missing))
                    yield event


def drawn_here(spec: Spec, out: Path, **more: object) -> RunReport:
    """Run to the end in this process."""
    return run(RunOptions(spec, out), ThisProcess(), **more)  # type: ignore[arg-type]


def contents(out: Path) -> dict[str, bytes]:
    """Return all files of a data set by name."""
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.is_file()
    }
