"""Meshes read from buffers equal those read from textures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from setups import frontal, head_of, probe, run_frame, scene_of

from dermis.atlas.build import cached_atlas
from dermis.frame.features.shape.mesh import upload_geometry
from dermis.frame.features.shape.shape import evaluate_rest_shape, shape_tables
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import uv_sphere

BALL = head_of(uv_sphere(30.0, 24, 12))
IN_BUFFERS = (("MESH_IN_BUFFERS", 1),)


def test_buffers_equal_textures(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    inputs = run_frame(renderer, scene_of(BALL, frontal()), atlas=64)
    adapter = replace(renderer.device.adapter, kind="DiscreteGPU")  # which reads buffers
    with monkeypatch.context() as patch:
        patch.setattr(renderer.device, "adapter", adapter)
        patch.setattr(renderer.device, "programs", {})  # those of software write textures
        tables = shape_tables(renderer.device, BALL)
        shape = evaluate_rest_shape(renderer.device, tables, BALL.positions_mm)
        held = upload_geometry(renderer.device, BALL.mesh, cached_atlas(BALL.mesh, 64), shape)
    # the texture from one, the buffers from the other: what is read is the same
    both = held.resources | {name: inputs.bindings[name] for name in ("triangle_table", "vertex_table")}
    atlas = inputs.layouts[0].atlas.resources["atlas"]
    bound = inputs.bindings | both | {"atlas": atlas, "footprint": {"side": 1 / 64}}
    outputs = ["relief", "arriving"]
    for one, other in zip(
        probe(renderer.device, "surface_probe", (64, 64), outputs, **bound),
        probe(renderer.device, "surface_probe", (64, 64), outputs, IN_BUFFERS, **bound),
        strict=True,
    ):
        assert (one != 0).any() and np.array_equal(one, other)
