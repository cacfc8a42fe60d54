"""A moving head small enough to render quickly: two targets, a bone, and clips in its file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gltf_file import GltfFile
from small_head import SIZE

from dermis.mesh.primitives import uv_sphere

STEP_S = 0.1
OPENS = (0.0, 1.0, 0.0, 1.0)
"""Weights of jawOpen in the clip talk, one each `STEP_S`."""
CAPTURE = """Timecode,BlendShapeCount,JawOpen,MouthSmileLeft,TongueOut
10:00:00:00.000,3,0,0,0.5
10:00:00:15.000,3,1,0,0.5
10:00:00:30.000,3,0,1,0.5
"""
"""Half a second at 60 frames a second as Live Link Face writes it."""


def write_moving_head(path: Path, clips: int = 1) -> Path:
    """Write a .glb with an ellipsoid in metres, the clip "talk" and optionally "nod"."""
    ball, file = uv_sphere(0.5, 24, 12), GltfFile()
    places = ball.positions * np.array(SIZE) / 1000
    low = np.clip(-ball.positions[:, 1] / 0.5, 0, 1) * np.clip(ball.positions[:, 2] / 0.5, 0, 1)
    side = np.clip(ball.positions[:, 0] / 0.5, 0, 1)
    targets = {
        "jawOpen": file.numbers(low[:, None] * [0, -0.06, 0]),
        "mouthSmileLeft": file.numbers(side[:, None] * [0.03, 0.02, 0]),
    }
    primitive: dict[str, Any] = {
        "attributes": {
            "POSITION": file.numbers(places),
            "TEXCOORD_0": file.numbers(ball.uv),
            "JOINTS_0": file.numbers(np.zeros((len(places), 4)), "<u1"),
            "WEIGHTS_0": file.numbers(np.tile([1, 0, 0, 0], (len(places), 1))),
        },
        "indices": file.numbers(np.ravel(ball.triangles)[:, None], "<u2"),
        "targets": [{"POSITION": index} for index in targets.values()],
    }
    mesh = file.add("meshes", primitives=[primitive], extras={"targetNames": list(targets)})
    face, head = file.add("nodes", name="face", mesh=mesh, skin=0), file.add("nodes", name="head")
    file.add("skins", joints=[head])
    weights = np.zeros((len(OPENS), 2))
    weights[:, 0] = OPENS
    turn = [[0, 0, 0, 1], [0, 0.3, 0, 0.954]]
    moves = [("talk", "weights", face, weights.reshape(-1, 1)), ("nod", "rotation", head, turn * 2)]
    times = file.numbers(STEP_S * np.arange(len(OPENS))[:, None])
    for name, what, node, values in moves[:clips]:
        sampler = {"input": times, "output": file.numbers(values), "interpolation": "LINEAR"}
        channel = {"sampler": 0, "target": {"node": node, "path": what}}
        file.add("animations", name=name, samplers=[sampler], channels=[channel])
    return file.write(path, face, head)
