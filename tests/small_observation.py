"""Synthetic observations of a renderer, for tests of data set files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dermis.apps.batch.records import encode_record
from dermis.apps.batch.shards import Shard, ShardWriter, list_shards
from dermis.apps.batch.spec import Spec, parse_spec
from dermis.frame.observation import Landmarks, Observation
from dermis.scene.opencv import OpenCvCamera
from dermis.scene.outputs import OUTPUTS

SIZE = 24, 16
OUTPUT_NAMES = "depth", "normal", "uv", "triangle", "motion", "alpha"


def small_spec(**values: Any) -> Spec:
    """Return a spec of seven images in shards of three."""
    told = {"count": 7, "shard_size": 3, "size": SIZE, "outputs": OUTPUT_NAMES}
    return parse_spec({**told, **values})


def observation(number: int, alpha: bool = False, outputs: tuple[str, ...] = OUTPUT_NAMES) -> Observation:
    """Return plausible outputs for an image number."""
    rng = np.random.default_rng(number)
    width, height = SIZE
    camera = OpenCvCamera(np.diag([500.0, 500.0, 1.0]), np.eye(3), np.array([0.0, 1.0, 600.0 + number]))
    points = Landmarks(
        names=("left", "right"),
        positions_mm=rng.normal(0, 50, (2, 3)).astype(np.float32),
        pixels=rng.uniform(0, 16, (2, 2)),
        visible=np.array([True, False]),
        occlusion=np.array([number % 2, 2], np.uint8),
    )
    return Observation(
        picture=rng.integers(0, 256, (height, width, 4 if alpha else 3), np.uint8),
        outputs={name: _values(name, rng) for name in outputs},
        camera=camera,
        head_pose=np.eye(3, 4),
        gaze=None if number == 2 else np.array([[0, 0, -1.0], [0, 0.6, -0.8]]),
        landmarks={"ibug-68": points},
    )


def _values(name: str, rng: np.random.Generator) -> Any:
    width, height = SIZE
    output = OUTPUTS[name]
    shape = (height, width) if output.channels == 1 else (height, width, output.channels or 2)
    if np.dtype(output.kind).kind in "iu":
        return rng.integers(0, 200, shape).astype(output.kind)
    if name == "depth":
        return (rng.uniform(400, 900, shape) * rng.integers(0, 2, shape)).astype(np.float32)
    if name.startswith("normal"):
        found = rng.normal(size=shape)
        found /= np.linalg.norm(found, axis=-1, keepdims=True)
        return (found * rng.integers(0, 2, (height, width, 1))).astype(np.float32)
    return rng.uniform(0, 1, shape).astype(np.float32)


def write_shard(out: Path, shard: Shard, spec: Spec) -> None:
    """Write a shard as a worker does."""
    with ShardWriter(out, shard, spec, "an adapter") as writer:
        for number in range(shard.first, shard.stop):
            seen = observation(number, spec.format == "folder", spec.outputs)
            writer.add(number, encode_record(number, seen, spec.parameters(number), spec))


def write_all(out: Path, spec: Spec) -> None:
    """Write a data set without its index."""
    out.mkdir(parents=True, exist_ok=True)
    for shard in list_shards(spec):
        write_shard(out, shard, spec)
