"""The small head with expressions and bones as a glTF file, and motions for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from gltf_file import GltfFile, add_mesh
from small_head import SIZE

from dermis.mesh.primitives import uv_sphere

TARGETS = {
    "jawOpen": ((0.0, -0.3, 0.4), (0.0, -30.0, 0.0)),
    "mouthSmileLeft": ((0.2, -0.2, 0.4), (8.0, 10.0, 0.0)),
    "mouthSmileRight": ((-0.2, -0.2, 0.4), (-8.0, 10.0, 0.0)),
    "browInnerUp": ((0.0, 0.3, 0.4), (0.0, 12.0, 6.0)),
}
"""Where each moves the head, in its size, and how far [mm]."""
BONES = ("neck", "head")
_M = 1e-3
_WIDTH = 0.2  # of a target, in the head's size
_CLIP_S = 2.0


def write_rigged_head(path: Path) -> Path:
    """Write a .glb with four targets, two bones, and the clip "talk", which moves the jaw and the head."""
    ball, file = uv_sphere(0.5, 24, 12), GltfFile()
    moves = {name: _bump(ball.positions, *how) for name, how in TARGETS.items()}
    share = np.clip(ball.positions[:, 1] / 0.4 + 1.0, 0.0, 1.0)
    weights = np.column_stack([1.0 - share, share, 0.0 * share, 0.0 * share])
    given = {
        "TEXCOORD_0": file.numbers(ball.uv),
        "JOINTS_0": file.numbers(np.tile([0, 1, 0, 0], (len(share), 1)), "<u1"),
        "WEIGHTS_0": file.numbers(weights),
    }
    targets = {name: file.sparse(_M * move) for name, move in moves.items()}
    mesh = add_mesh(file, _M * ball.positions * SIZE, ball.triangles, targets, given)
    file.add("nodes", name="neck", children=[1], translation=[0.0, -0.1, 0.0])
    file.add("nodes", name="head", translation=[0.0, 0.08, 0.0])
    file.add("nodes", name="face", mesh=mesh, skin=0)
    places = np.tile(np.eye(4), (2, 1, 1))
    places[:, 1, 3] = 0.1, 0.02
    bound = file.numbers(places.transpose(0, 2, 1).reshape(-1, 16))
    file.add("skins", joints=[0, 1], inverseBindMatrices=bound)
    _add_clip(file)
    return file.write(path, 0, 2)


def write_take(path: Path, *jaw: float) -> Path:
    """Write a CSV of Live Link Face with 10 frames per second in which the jaw opens by the given weights."""
    rows = [f"10:00:{k // 10:02}:{k % 10:02}.000,61,{weight}" for k, weight in enumerate(jaw)]
    path.write_text("\n".join(["Timecode,BlendShapeCount,JawOpen", *rows, ""]))
    return path


def _bump(places: np.ndarray, middle: tuple[float, ...], way: tuple[float, ...]) -> np.ndarray:
    off = ((places - middle) ** 2).sum(axis=1)
    strength = np.exp(-off / _WIDTH**2)
    return np.asarray(np.where(strength > 0.01, strength, 0.0)[:, None] * way)


def _add_clip(file: GltfFile) -> None:
    times = file.numbers([[0.0], [_CLIP_S / 2], [_CLIP_S]])
    opened = np.zeros((3, len(TARGETS)))
    opened[1, 0] = 1.0
    turned = np.array([[0, 0, 0, 1], [0, 0.6, 0, 0.8], [0, 0, 0, 1]], float)
    outputs = (2, "weights", file.numbers(opened.reshape(-1, 1))), (1, "rotation", file.numbers(turned))
    samplers = [{"input": times, "interpolation": "LINEAR", "output": one} for _, _, one in outputs]
    listed = [{"sampler": k, "target": {"node": n, "path": p}} for k, (n, p, _) in enumerate(outputs)]
    file.add("animations", name="talk", samplers=samplers, channels=listed)
