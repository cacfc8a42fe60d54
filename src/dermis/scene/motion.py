"""Motion by file, of any kind."""

from __future__ import annotations

import os
from pathlib import Path

from dermis.base.errors import refuse
from dermis.base.reading import checked_path, is_file
from dermis.formats.motion.gltf_clip import load_gltf_clip
from dermis.formats.motion.live_link import load_live_link
from dermis.formats.motion.mediapipe import load_mediapipe
from dermis.formats.motion.sequence import is_sequence, load_sequence
from dermis.formats.parts import is_gltf
from dermis.mesh.clip import Clip, check_rate
from dermis.mesh.head import Head
from dermis.scene.head_table import UpAxis, check_options

_JSON_LINES = (".jsonl", ".ndjson", ".json")
_KINDS = "a glTF clip (.glb .gltf), Live Link Face (.csv), MediaPipe (.jsonl) or a sequence of .obj or .ply"


def load_motion(
    path: str | os.PathLike[str],
    head: Head,
    *,
    clip: str | None = None,
    fps: float | None = None,
    unit_mm: float | None = None,
    up: UpAxis = "y",
) -> Clip:
    """The motion that a file holds, for a head: `Clip.pose_at` gives its pose at any time.

    path : a glTF file, the head's own or another with nodes or targets of the same names, "file.glb#clip"
        for one of several clips; a CSV of Live Link Face; lines of JSON with MediaPipe's blend shapes; or
        files with one topology: a folder, "face_%05d.obj" or "face_*.ply"
    clip : the clip of a glTF file
    fps : frames a second of a sequence, 30 when left out; of a CSV's timecode where it does not tell; of
        lines without time
    unit_mm, up : of a sequence's files, see `load_head`

    Raises DermisError for files that cannot be read, which it names with their lines, and for motion of
    which the head has no name; what it has only in part, `Clip.note` tells.
    """
    clip_path = checked_path(path, _KINDS)
    check_options(unit_mm=unit_mm, up=up)
    fps = None if fps is None else check_rate("fps", fps)
    source, clip_name = _split_clip_name(clip_path, clip)
    if is_gltf(source):
        return load_gltf_clip(source, head, clip_name)
    if clip_name is not None:
        refuse(source, "a clip's name with a glTF file alone", f"got {clip_name!r}", "Leave it out")
    if is_sequence(source):
        return load_sequence(source, head, fps, unit_mm, up)
    if not is_file(source):
        refuse(source, _KINDS, "there is no such file", "Check the name")
    if source.suffix.lower() not in (".csv", *_JSON_LINES):
        refuse(source, _KINDS, f"the suffix is {source.suffix!r}", "Convert it to one of these")
    load = load_live_link if source.suffix.lower() == ".csv" else load_mediapipe
    return load(source, head, fps)


def _split_clip_name(path: Path, clip: str | None) -> tuple[Path, str | None]:
    """A file, and the name of a clip that was written after it."""
    file, sign, name = str(path).rpartition("#")
    if sign and not is_file(path) and is_gltf(file):
        return Path(file), clip or name
    return path, clip
