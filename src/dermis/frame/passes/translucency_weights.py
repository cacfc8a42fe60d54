"""How much light passes between translucent pairs; computed once for a profile."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.translucency.pairs import TranslucentPairs
from dermis.disk import cached_array
from dermis.frame.atlas_layout import PairBuffers
from dermis.frame.passes import program
from dermis.gpu import ComputeProgram, Device, Frame, make_texture, scratch, upload
from dermis.optics.gaussians import MOST_GAUSSIANS

Floats = NDArray[np.float64]
ROW = 1024  # as in the shaders
GRAIN = 0.72  # Gaussians of more variance than this times the squared spacing sum evenly to 1e-6
_SMOOTH = 0.45  # of the spacing; light of this standard deviation has no detail that the sources miss


def upload_pairs(device: Device, table: TranslucentPairs, key: str = "") -> PairBuffers:
    """The pairs as the shaders read them.

    key : identifies the table, if its weights are to be kept on disk
    """
    count, number = len(table.source), len(table.texel)
    pairs = np.zeros((max(1, count), 3), np.uint32)
    pairs[:count, 0] = table.source
    pairs[:count, 1:] = np.ascontiguousarray(table.geometry).view(np.uint32)
    sources = np.zeros((max(1, number), 2), np.uint32)
    sources[:number, 0] = np.ascontiguousarray(table.texel).view(np.uint32)[:, 0]
    sources[:number, 1] = table.area_mm2.view(np.uint32)
    receivers = _receivers(table)
    return PairBuffers(
        side=len(table.receiver),
        radius_mm=float(table.radius_mm),
        spacing_mm=float(table.spacing_mm),
        receivers=device.buffer(receivers, "STORAGE"),
        pairs=device.buffer(pairs, "STORAGE"),
        sources=device.buffer(sources, "STORAGE"),
        count=len(pairs),
        source_count=len(sources),
        receiver_count=len(receivers),
        light=_unlit(device, table.receiver > 0),
        key=key,
    )


def _receivers(table: TranslucentPairs) -> NDArray[np.uint32]:
    """(m, 3) cell, x and y packed, first pair, end of the pairs; one without pairs where there are none.

    Those with most pairs come first, so that invocations side by side have equally many, and the last
    workgroups few.
    """
    y, x = np.nonzero(table.receiver > 1)
    which = table.receiver[y, x]
    first, end = table.first[which], table.first[which + 1]
    order = np.argsort(first.astype(np.int64) - end, kind="stable")
    listed = np.stack([x | (y << 16), first, end], axis=-1)[order].astype(np.uint32)
    return listed if len(listed) else np.zeros((1, 3), np.uint32)


def _unlit(device: Device, surface: NDArray[np.bool_]) -> Any:
    light = np.zeros((*surface.shape, 4), np.float32)
    light[..., 3] = surface
    texture = make_texture(device, surface.shape, "rgba32float")
    upload(device, texture, light)
    return scratch(device, texture)


def source_level(pairs: PairBuffers, variance_mm2: Floats) -> int:
    """The first blurred level that is smooth enough for the sources to sample all of its detail."""
    smooth = np.flatnonzero(variance_mm2 >= (_SMOOTH * pairs.spacing_mm) ** 2)
    return int(smooth[0]) if len(smooth) else len(variance_mm2) - 1


def weigh(device: Device, pairs: PairBuffers, variance_mm2: Floats, weight: Floats) -> Any:
    """A buffer of each pair's source and the share of its light, red, green and blue, that passes.

    variance_mm2, weight : (k,) and (k, 3) of the blurred levels
    """
    shader = program(device, "translucency_weights.wgsl")
    gaussian = np.zeros((MOST_GAUSSIANS, 4), np.float32)
    gaussian[: len(weight), :3], gaussian[: len(weight), 3] = weight, variance_mm2
    record = shader.record(
        "Weighing",
        radius_mm=pairs.radius_mm,
        before_mm2=variance_mm2[source_level(pairs, variance_mm2)],
        cell_mm2=pairs.spacing_mm**2,
        grain=GRAIN,
        count=len(weight),
        gaussian=gaussian,
    )
    adapter = device.adapter
    if not pairs.key or adapter.kind != "CPU":  # GPUs weigh faster than disks are read
        return _weighed(device, shader, pairs, record)
    told = adapter.name, adapter.driver, shader.source.text, record.tobytes().hex()

    def make() -> NDArray[np.uint8]:
        weights = _weighed(device, shader, pairs, record)
        return np.frombuffer(device.handle.queue.read_buffer(weights), np.uint8)

    return device.buffer(cached_array((), f"passing {pairs.key} {told}", make), "STORAGE")


def _weighed(device: Device, shader: ComputeProgram, pairs: PairBuffers, record: Any) -> Any:
    weights = device.handle.create_buffer(size=8 * pairs.count, usage=pairs.pairs.usage)
    bound = {"weighing": record, "pairs": pairs.pairs, "sources": pairs.sources, "weights": weights}
    frame = Frame(device)
    frame.compute("translucency weights", shader, bound, (ROW, -(-pairs.count // ROW)))
    frame.submit()
    return weights
