"""Output from outside the package."""

from __future__ import annotations

from pathlib import Path

from dermis.scene.outputs import Output

SHADER = Path(__file__).with_suffix(".wgsl")
UV_SUM = Output("uv_sum", "geometry", "A", "float32", "", "sum of the uv", shader=SHADER)
