"""Animation clips of glTF files."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.formats.gltf.animations import AnimationCurve, AnimationTrack, read_clip
from dermis.formats.motion.captures import frame_rate, refuse_unmatched
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.mesh.pose import MOST_WEIGHT, Pose
from dermis.mesh.rotations import matrix_quaternion, quaternion_matrix
from dermis.mesh.skeleton import Skeleton


class _Transforms(NamedTuple):
    """Where bones rest in their parents' spaces: each (n, 3), (n, 4), (n, 3)."""

    translation: Doubles
    rotation: Doubles
    scale: Doubles


class _UsedTrack(NamedTuple):
    """A curve, the columns of it that are used, and which of the bones or targets each moves."""

    path: str
    curve: AnimationCurve
    columns: list[int]
    places: list[int]


def load_gltf_clip(path: Path, head: Head, name: str | None) -> Clip:
    """A clip of a .glb or .gltf file for a head with nodes or targets of the same names, as a rule its own.

    What a clip leaves out of a bone's translation, rotation and scale stays as it rests.

    name : of the clip; needed where there are several

    Raises DermisError for a damaged clip and for one of which the head has no name.
    """
    clip, skeleton = read_clip(path, name), head.control.skeleton
    bones = _used_names([track for track in clip.tracks if track.path != "weights"], head.bones)
    targets = _used_names([track for track in clip.tracks if track.path == "weights"], head.targets)
    names = tuple(dict.fromkeys(name for track in clip.tracks for name in track.names))
    if not bones and not targets:
        refuse_unmatched(f"{path}: clip {clip.name!r}", names, head)
    parts = [_used_track(track, targets if track.path == "weights" else bones) for track in clip.tracks]
    rests = _rest_transforms(skeleton, bones) if skeleton is not None and bones else None

    def sample(seconds: float) -> Pose:
        weights = np.zeros(len(targets))
        moved = None if rests is None else _Transforms(*(one.copy() for one in rests))
        for moves, curve, columns, places in parts:
            values = curve.sample(seconds)
            if moves == "weights":
                weights[places] = values[0, columns]
            elif moved is not None and places:
                getattr(moved, moves)[places] = values[columns]
        matrices = [] if moved is None else list(_matrices(moved))
        shares = dict(zip(targets, weights.tolist(), strict=True))
        if len(weights) and not np.abs(weights).max() <= MOST_WEIGHT:
            actual = f"got {weights[np.argmax(np.abs(weights))]:g} at {seconds:g} s"
            refuse(path, f"weights from -{MOST_WEIGHT:g} to {MOST_WEIGHT:g}", actual, "Export it again")
        return Pose(shares, dict(zip(bones, matrices, strict=True)))

    times = [track.curve.times_s for track in clip.tracks]
    end, rate = max(float(one[-1]) for one in times), frame_rate(max(times, key=len))
    left_out = tuple(one for one in names if one not in (*bones, *targets))
    return Clip(clip.name, end, rate, tuple(targets), tuple(bones), left_out, sample)


def _used_names(tracks: list[AnimationTrack], known: tuple[str, ...]) -> list[str]:
    """Names that the tracks move and the head has."""
    return [name for name in dict.fromkeys(name for track in tracks for name in track.names) if name in known]


def _used_track(track: AnimationTrack, used: list[str]) -> _UsedTrack:
    columns = [k for k, name in enumerate(track.names) if name in used]
    return _UsedTrack(track.path, track.curve, columns, [used.index(track.names[k]) for k in columns])


def _rest_transforms(skeleton: Skeleton, bones: list[str]) -> _Transforms:
    """Translations, rotations and scales of bones at rest."""
    local = skeleton.local[[skeleton.index[name] for name in bones]]
    linear = local[:, :3, :3]
    scale = np.linalg.norm(linear, axis=1)
    scale[np.linalg.det(linear) < 0, 0] *= -1
    turned = np.where(scale[:, None] == 0, np.eye(3), linear / np.where(scale == 0, 1, scale)[:, None])
    return _Transforms(local[:, :3, 3].copy(), matrix_quaternion(turned), scale)


def _matrices(moved: _Transforms) -> Doubles:
    """(n, 4, 4) translation after rotation after scale."""
    matrices = quaternion_matrix(moved.rotation)
    matrices[:, :3, :3] *= moved.scale[:, None, :]
    matrices[:, :3, 3] = moved.translation
    return matrices
