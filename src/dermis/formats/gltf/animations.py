"""Reading of animation clips from glTF files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple, get_args

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.base.reading import MALFORMED_DATA_ERRORS, refuse_parse_errors
from dermis.formats.gltf.document import Document, Tree, checked_index, read_document
from dermis.formats.gltf.nodes import Nodes, read_nodes
from dermis.formats.gltf.rigs import target_names
from dermis.formats.size_limits import DAMAGED_ADVICE, MAX_ANIMATION_CURVES, check_limit
from dermis.mesh.rotations import slerp

_PROPERTY_COMPONENT_COUNTS = {"translation": 3, "rotation": 4, "scale": 3}
Interpolation = Literal["STEP", "LINEAR", "CUBICSPLINE"]
_SPLINE_TANGENT_IN, _SPLINE_VALUE, _SPLINE_TANGENT_OUT = range(3)


class AnimationTrack(NamedTuple):
    """Animated property of one or more nodes or morph targets, with the curve of its values.

    path : name of the property: "translation", "rotation" or "scale" of nodes, or "weights" of morph targets
    names : (m,) names of the nodes or morph targets
    """

    path: str
    names: tuple[str, ...]
    curve: AnimationCurve


@dataclass(frozen=True, eq=False)
class Animation:
    """Animation clip of a glTF file: its name and its tracks."""

    name: str
    tracks: tuple[AnimationTrack, ...]


class _Keyframes(NamedTuple):
    times_s: Doubles
    values: Doubles
    kind: Interpolation


def clip_names(path: Path) -> tuple[str, ...]:
    """Return the names of a file's animation clips; unnamed clips are called "clip 0", "clip 1" etc."""
    return _document_clip_names(read_document(path))


def read_clip(path: Path, clip_name: str | None) -> Animation:
    """Read an animation clip of a .glb or .gltf file.

    clip_name : name of the clip; None for the only clip of the file

    Raises DermisError for a missing or damaged clip.
    """
    document = read_document(path)
    names = _document_clip_names(document)
    if not names:
        refuse(path, "a file with animation clips", "it has none", "Export it with its animation")
    if clip_name is None and len(names) > 1:
        actual, advice = f"it has {', '.join(names)}", f"Name one, as in {path.name}#{names[0]}"
        refuse(path, "the name of a clip", actual, advice)
    if clip_name is not None and clip_name not in names:
        refuse(path, f"one of its clips ({', '.join(names)})", f"got {clip_name!r}", "Correct the name")
    index = 0 if clip_name is None else names.index(clip_name)
    with refuse_parse_errors(
        f"{path}: clip {names[index][:80]!r}", "a valid animation", *MALFORMED_DATA_ERRORS
    ):
        return Animation(names[index], tuple(_read_tracks(document, index, names[index])))


def _document_clip_names(document: Document) -> tuple[str, ...]:
    clips = document.top_level_array("animations")
    return tuple(str(clip.get("name") or f"clip {k}") for k, clip in enumerate(clips))


def _read_tracks(document: Document, clip_index: int, clip_name: str) -> list[AnimationTrack]:
    """Return the tracks of a clip; channels with equal path, interpolation and key times share one track."""
    clip, nodes = document.top_level_object("animations", clip_index), read_nodes(document)
    error_subject = f"{document.path}: clip {clip_name!r}"
    check_limit(error_subject, len(clip["channels"]), MAX_ANIMATION_CURVES, "channels", "Export it again")
    groups: dict[tuple[object, ...], list[tuple[str, _Keyframes]]] = {}
    tracks, names = [], dict[int, tuple[str, ...]]()
    for channel_index, channel in enumerate(clip["channels"]):
        target, error_subject = (
            channel["target"],
            f"{document.path}: clip {clip_name!r}, channel {channel_index}",
        )
        if "node" not in target or target["path"] not in (*_PROPERTY_COMPONENT_COUNTS, "weights"):
            continue  # a target of an extension
        _check_node_index(nodes, target["node"], error_subject)
        sampler = clip["samplers"][checked_index(channel["sampler"], len(clip["samplers"]), "samplers")]
        if target["path"] == "weights":
            tracks.append(_weight_track(document, target["node"], sampler, error_subject, names))
            continue
        keys = _read_keyframes(document, sampler, _PROPERTY_COMPONENT_COUNTS[target["path"]], error_subject)
        rotations = keys.values[:, _SPLINE_VALUE] if keys.kind == "CUBICSPLINE" else keys.values
        if target["path"] == "rotation" and not rotations.any(axis=-1).all():
            refuse(error_subject, "unit quaternions as rotations", "one is 0", DAMAGED_ADVICE)
        group = (target["path"], keys.kind, keys.times_s.tobytes())
        groups.setdefault(group, []).append((nodes.names[target["node"]], keys))
    return tracks + [_merge_tracks(str(path), members) for (path, *_), members in groups.items()]


def _check_node_index(nodes: Nodes, node_index: int, error_subject: str) -> None:
    if not 0 <= node_index < len(nodes.names):
        refuse(
            error_subject,
            f"a node from 0 to {len(nodes.names) - 1}",
            f"got node {node_index}",
            DAMAGED_ADVICE,
        )


def _weight_track(
    document: Document,
    mesh_node_index: int,
    sampler: Tree,
    error_subject: str,
    mesh_targets: dict[int, tuple[str, ...]],
) -> AnimationTrack:
    """Return the track of the morph target weights of a node.

    mesh_node_index : index of the node that carries the mesh with the morph targets
    sampler : JSON tree of the animation sampler
    error_subject : file, clip and channel, for error messages
    mesh_targets : dictionary from mesh index to the names of the mesh's morph targets; used as a cache, to
        which this function adds the mesh of the node
    """
    mesh = document.top_level_array("nodes")[mesh_node_index].get("mesh")
    if mesh is not None and mesh not in mesh_targets:
        mesh_targets[mesh] = target_names(document.top_level_object("meshes", mesh))
    names = () if mesh is None else mesh_targets[mesh]
    if not names:
        actual = f"node {mesh_node_index} has no morph targets"
        refuse(error_subject, "weights of a mesh with morph targets", actual, DAMAGED_ADVICE)
    keys = _read_keyframes(document, sampler, len(names), error_subject)
    curve = AnimationCurve(keys.times_s, keys.values[..., None, :], keys.kind)
    return AnimationTrack("weights", names, curve)


def _merge_tracks(animated_property: str, keyframes_by_name: list[tuple[str, _Keyframes]]) -> AnimationTrack:
    """Merge the keyframes of one property of several nodes, which have equal key times, into one track.

    animated_property : `path` of the track, see `AnimationTrack`
    keyframes_by_name : name and keyframes of each node
    """
    keys = keyframes_by_name[0][1]
    values = np.stack([own.values for _, own in keyframes_by_name], axis=-2)
    curve = AnimationCurve(keys.times_s, values, keys.kind, is_rotation=animated_property == "rotation")
    return AnimationTrack(animated_property, tuple(name for name, _ in keyframes_by_name), curve)


def _read_keyframes(
    document: Document, sampler: Tree, component_count: int, error_subject: str
) -> _Keyframes:
    """Read the times and values of the k keys of an animation sampler.

    The values have the shape (k, n). For cubic splines they include tangents and have the shape (k, 3, n).

    sampler : JSON tree of the animation sampler
    component_count : number n of components per key
    error_subject : file, clip and channel, for error messages
    """
    kind = sampler.get("interpolation", "LINEAR")
    if kind not in get_args(Interpolation):
        kinds = ", ".join(get_args(Interpolation))
        refuse(error_subject, f"an interpolation of {kinds}", f"got {kind!r}", DAMAGED_ADVICE)
    times, values = document.read_floats(sampler["input"]).ravel(), document.read_floats(sampler["output"])
    shape = (len(times), 3, component_count) if kind == "CUBICSPLINE" else (len(times), component_count)
    if len(times) == 0 or values.size != np.prod(shape):
        actual = f"got {len(times)} and {values.size}"
        refuse(error_subject, f"a time and {np.prod(shape[1:])} numbers for each key", actual, DAMAGED_ADVICE)
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        refuse(error_subject, "finite keys", "some are NaN or infinite", DAMAGED_ADVICE)
    if (np.diff(times) < 0).any():
        early = int(np.flatnonzero(np.diff(times) < 0)[0])
        actual = f"key {early + 1} at {times[early + 1]:g} s comes after {times[early]:g} s"
        refuse(error_subject, "keys in temporal order", actual, DAMAGED_ADVICE)
    return _Keyframes(times, values.reshape(shape), kind)


@dataclass(frozen=True, eq=False)
class AnimationCurve:
    """Animated property of m nodes as a function of time, with n components for each node.

    The property is a translation, rotation or scale, whose keys are at the same times for all nodes, or the
    weights of the n morph targets of a mesh; then m is 1.

    times_s : (k,) times of the keys, not decreasing [s]
    values : (k, m, n) values at the keys; for a cubic spline (k, 3, m, n): in-tangent, value, out-tangent
    kind : interpolation between keys
    is_rotation : whether the values are quaternions (n = 4), for which "LINEAR" is spherical interpolation

    Source: glTF 2.0, appendix C.
    """

    times_s: Doubles
    values: Doubles
    kind: Interpolation = "LINEAR"
    is_rotation: bool = False

    def sample(self, seconds: float) -> Doubles:
        """Return the value of the property at a time [s]: n components for each of the m nodes, (m, n).

        Before the first key and after the last key, the value is constant.
        """
        index = int(np.searchsorted(self.times_s, seconds, side="right")) - 1
        keys = self.values[:, _SPLINE_VALUE] if self.kind == "CUBICSPLINE" else self.values
        if index < 0 or index + 1 >= len(self.times_s):
            return self._normalise_rotations(keys[max(index, 0)])
        if self.kind == "STEP":
            return self._normalise_rotations(keys[index])
        step = float(self.times_s[index + 1] - self.times_s[index])
        fraction = (seconds - float(self.times_s[index])) / step
        if self.kind == "CUBICSPLINE":
            return self._normalise_rotations(self._cubic_spline_value(index, fraction, step))
        if self.is_rotation:
            return slerp(
                self._normalise_rotations(keys[index]), self._normalise_rotations(keys[index + 1]), fraction
            )
        return np.asarray((1 - fraction) * keys[index] + fraction * keys[index + 1])

    def _cubic_spline_value(self, key_index: int, fraction: float, interval_s: float) -> Doubles:
        before, after = self.values[key_index], self.values[key_index + 1]
        value = (2 * fraction**3 - 3 * fraction**2 + 1) * before[_SPLINE_VALUE] + (
            3 * fraction**2 - 2 * fraction**3
        ) * after[_SPLINE_VALUE]
        value += interval_s * (fraction**3 - 2 * fraction**2 + fraction) * before[_SPLINE_TANGENT_OUT]
        value += interval_s * (fraction**3 - fraction**2) * after[_SPLINE_TANGENT_IN]
        return np.asarray(value)

    def _normalise_rotations(self, key_values: Doubles) -> Doubles:
        return (
            key_values / np.linalg.norm(key_values, axis=-1, keepdims=True)
            if self.is_rotation
            else key_values
        )
