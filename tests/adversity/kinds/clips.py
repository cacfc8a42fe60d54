"""Motions: captures, clips of glTF files, sequences of meshes."""

from __future__ import annotations

import json
from functools import cache
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from adversity.case import Input, Plan
from adversity.checks import check_finite
from adversity.kind import Kind
from adversity.kinds.meshes import moving_files
from moving_head import CAPTURE
from small_head import obj_text

_SHAPES = {"jawOpen": 0.2, "mouthSmileLeft": 0.1, "_neutral": 0.0}
_MATRIX = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -50.0], [0.0, 0.0, 0.0, 1.0]]
_LOST = """Timecode;BlendShapeCount;JawOpen;MouthSmileLeft;HeadYaw
10:00:00:00,000;3;12,5;;0,1
10:00:00:15,000;0;;;
10:00:00:30,000;3;80;50;0,2
"""
_FRAMES = 4


def _mediapipe() -> bytes:
    own = {"time": 0.0, "blendshapes": _SHAPES, "matrix": _MATRIX}
    listed = [{"categoryName": name, "score": score} for name, score in _SHAPES.items()]
    theirs = {"timestamp_ms": 33, "faceBlendshapes": listed, "facialTransformationMatrix": _MATRIX}
    return "\n".join(map(json.dumps, (own, theirs, own | {"time": 0.066}))).encode()


def _results() -> bytes:
    """Return results as MediaPipe's JavaScript API has them, with a frame without a face."""
    categories = [
        {"index": k, "score": score, "categoryName": name} for k, (name, score) in enumerate(_SHAPES.items())
    ]
    matrix = {"rows": 4, "columns": 4, "data": [row[k] for k in range(4) for row in _MATRIX]}
    face = {"faceBlendshapes": [{"categories": categories}], "facialTransformationMatrixes": [matrix]}
    lost: dict[str, list[Any]] = {key: [] for key in face}
    return json.dumps(
        [{"timestamp": 33 * k} | frame for k, frame in enumerate((face, lost, face))], indent=1
    ).encode()


@cache
def files_of_motions() -> dict[str, dict[str, bytes]]:
    """Return files by the name of the motion; those of a sequence are in a folder."""
    angles = "\n".join(
        line + rest
        for line, rest in zip(
            CAPTURE.split("\n"), (",HeadYaw,HeadPitch", ",0,0", ",0.1,0", ",0.2,0.1", ""), strict=True
        )
    )
    frames = {f"frames/face_{k:03}.obj": obj_text().encode() for k in range(_FRAMES)}
    return {
        "take.jsonl": {"take.jsonl": _mediapipe()},
        "results.json": {"results.json": _results()},
        "take.csv": {"take.csv": angles.encode()},
        "lost.csv": {"lost.csv": _LOST.encode()},
        "clip.glb#talk": {"clip.glb": moving_files()[0]},
        "turning.glb": {"turning.glb": moving_files()[1]},
        "frames": frames,
        "frames/face_%03d.obj": frames,
    }


def _clip(rng: Random) -> Input:
    motion = rng.choice(tuple(files_of_motions()))
    head = "head.obj" if motion.startswith("frames") else "head.glb"
    heads = {"head.obj": obj_text().encode(), "head.glb": moving_files()[1]}
    files = files_of_motions()[motion]
    words = [head, "--motion", motion]
    return Input({head: heads[head], **files}, {"file": motion, "head": head, "words": words}, tuple(files))


@cache
def _head(name: str) -> Any:
    """Return the moving head, which is never damaged."""
    from pathlib import Path

    from dermis.scene.heads import load_head

    data = obj_text().encode() if name == "head.obj" else moving_files()[1]
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(data)
        return load_head(path)


def _take_clip(plan: Plan) -> None:
    from dermis.scene.motion import load_motion

    head = _head(plan["head"])
    clip = load_motion(plan["file"], head)
    for share in (0.0, 0.37, 1.0):
        pose = clip.pose_at(share * clip.duration_s)
        check_finite(pose.to_arrays(head.control_rig), "pose")


KINDS = (Kind("clip", _clip, _take_clip, share=16),)
