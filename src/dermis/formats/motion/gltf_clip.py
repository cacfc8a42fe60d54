"""Loading of glTF animation clips as motion of a head."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.formats.gltf.animations import AnimationCurve, AnimationTrack, read_clip
from dermis.formats.motion.captures import estimate_frame_rate, refuse_unmatched_motion
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.mesh.pose import MAX_WEIGHT, Pose
from dermis.mesh.rotations import matrix_quaternion, quaternion_matrix
from dermis.mesh.skeleton import Skeleton


class _BoneTransforms(NamedTuple):
    """Translations (n, 3), rotations (n, 4) and scales (n, 3) of n bones relative to their parents."""

    translation: Doubles
    rotation: Doubles
    scale: Doubles


class _MatchedTrack(NamedTuple):
    """Animation curve of a track, and the indices of those n bones or morph targets that the head has.

    path : property that the track animates: "translation", "rotation", "scale" or "weights"
    columns : (n,) for each of these n bones or morph targets, its index among the names in the track
    indices : (n,) for each of them, its index in the list that `_matched_names` returns for the whole clip
    """

    path: str
    curve: AnimationCurve
    columns: list[int]
    indices: list[int]


def load_gltf_clip(path: Path, head: Head, clip_name: str | None) -> Clip:
    """Load a clip of a .glb or .gltf file; bones and morph targets are matched to the head by name.

    If the clip does not animate the translation, rotation or scale of a bone, this property of the bone keeps
    its value at rest.

    clip_name : name of the clip; required if the file has several

    Raises DermisError for a damaged clip, and if no name matches the head.
    """
    clip, skeleton = read_clip(path, clip_name), head.control_rig.skeleton
    bones = _matched_names([track for track in clip.tracks if track.path != "weights"], head.bones)
    targets = _matched_names([track for track in clip.tracks if track.path == "weights"], head.targets)
    names = tuple(dict.fromkeys(name for track in clip.tracks for name in track.names))
    if not bones and not targets:
        refuse_unmatched_motion(f"{path}: clip {clip.name!r}", names, head)
    used_tracks = [
        _match_track(track, targets if track.path == "weights" else bones) for track in clip.tracks
    ]
    rest = _rest_transforms(skeleton, bones) if skeleton is not None and bones else None

    def sample(seconds: float) -> Pose:
        weights = np.zeros(len(targets))
        transforms = None if rest is None else _BoneTransforms(*(array.copy() for array in rest))
        for path_kind, curve, columns, indices in used_tracks:
            values = curve.sample(seconds)
            if path_kind == "weights":
                weights[indices] = values[0, columns]
            elif transforms is not None and indices:
                getattr(transforms, path_kind)[indices] = values[columns]
        matrices = [] if transforms is None else list(_bone_matrices(transforms))
        weight_of_target = dict(zip(targets, weights.tolist(), strict=True))
        if len(weights) and not np.abs(weights).max() <= MAX_WEIGHT:
            actual = f"got {weights[np.argmax(np.abs(weights))]:g} at {seconds:g} s"
            refuse(path, f"weights from -{MAX_WEIGHT:g} to {MAX_WEIGHT:g}", actual, "Export it again")
        return Pose(weight_of_target, dict(zip(bones, matrices, strict=True)))

    times = [track.curve.times_s for track in clip.tracks]
    end, rate = max(float(keys[-1]) for keys in times), estimate_frame_rate(max(times, key=len))
    unused = tuple(name for name in names if name not in (*bones, *targets))
    return Clip(clip.name, end, rate, tuple(targets), tuple(bones), unused, sample)


def _matched_names(tracks: list[AnimationTrack], head_names: tuple[str, ...]) -> list[str]:
    """Return the names of animated bones or morph targets that the head has, without duplicates.

    tracks : tracks that all animate bones, or all animate morph targets
    head_names : names of all bones, or of all morph targets, of the head
    """
    return [
        name for name in dict.fromkeys(name for track in tracks for name in track.names) if name in head_names
    ]


def _match_track(track: AnimationTrack, used_names: list[str]) -> _MatchedTrack:
    columns = [k for k, name in enumerate(track.names) if name in used_names]
    return _MatchedTrack(
        track.path, track.curve, columns, [used_names.index(track.names[k]) for k in columns]
    )


def _rest_transforms(skeleton: Skeleton, bones: list[str]) -> _BoneTransforms:
    """Return the translations, rotations and scales of the named bones at rest."""
    local = skeleton.local[[skeleton.index_by_name[name] for name in bones]]
    linear = local[:, :3, :3]
    scale = np.linalg.norm(linear, axis=1)
    scale[np.linalg.det(linear) < 0, 0] *= -1
    rotation = np.where(scale[:, None] == 0, np.eye(3), linear / np.where(scale == 0, 1, scale)[:, None])
    return _BoneTransforms(local[:, :3, 3].copy(), matrix_quaternion(rotation), scale)


def _bone_matrices(transforms: _BoneTransforms) -> Doubles:
    """Return the bone matrices (n, 4, 4), which apply the scale first, then rotation, then translation."""
    matrices = quaternion_matrix(transforms.rotation)
    matrices[:, :3, :3] *= transforms.scale[:, None, :]
    matrices[:, :3, 3] = transforms.translation
    return matrices
