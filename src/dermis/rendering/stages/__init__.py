"""The frame's stages: each a Python file that records it and a WGSL file of the same name."""

from pathlib import Path

STAGES = Path(__file__).parent
SHARED_SHADERS = Path(__file__).parent.parent / "wgsl"
