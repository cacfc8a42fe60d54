"""Loading of facial motion from animation, capture and mesh sequence files."""

from __future__ import annotations

import os
from pathlib import Path

from dermis.base.errors import refuse
from dermis.base.reading import checked_path, is_file
from dermis.formats.axes import Axis, Front
from dermis.formats.motion.gltf_clip import load_gltf_clip
from dermis.formats.motion.live_link import load_live_link
from dermis.formats.motion.mediapipe import load_mediapipe
from dermis.formats.motion.sequence import is_sequence, load_sequence
from dermis.formats.parts import is_gltf
from dermis.mesh.clip import Clip, check_frame_rate
from dermis.mesh.head import Head
from dermis.scene.head_table import check_options

_TABLE_SUFFIXES, _JSON_SUFFIXES = (".csv", ".tsv"), (".jsonl", ".ndjson", ".json")
_ACCEPTED_FILES = (
    "a glTF clip (.glb .gltf), Live Link Face (.csv), MediaPipe (.json .jsonl) or a sequence of .obj or .ply"
)


def load_motion(
    path: str | os.PathLike[str],
    head: Head,
    *,
    clip: str | None = None,
    fps: float | None = None,
    unit_mm: float | None = None,
    up: Axis | None = None,
    front: Front = "auto",
) -> Clip:
    r"""Load the motion of a head from a file.

    Parameters
    ----------
    path : str or path
        One of: a glTF file whose nodes or morph targets have the same names as in the head's file
        ("file.glb#clip" selects one of several clips); a CSV file of Live Link Face; a JSON file with results
        of MediaPipe's face landmarker; a sequence of mesh files with the topology of the head, written as a
        folder, "face_%05d.obj" or "face_*.ply".
    head : Head
        Head that moves.
    clip : str, optional
        Name of the clip in a glTF file.
    fps : float, optional
        Frame rate of a mesh sequence (by default 30), of a CSV file whose timecode does not imply a frame
        rate, or of MediaPipe results without times [1/s].
    unit_mm : float, optional
        Length of one unit in the files of a mesh sequence [mm]; by default, a unit in which the first mesh
        is about as large as the head.
    up : {"y", "z", "x", "-y", "-z", "-x"}, optional
        Upward axis of the files of a mesh sequence; without `up` and `front`, these files have the axes of
        the head's file.
    front : {"auto", "z", "-y", "x", "-z", "y", "-x"}
        Axis along which the face looks in the files of a mesh sequence. If `up` is given, "auto" means -y for
        z up, and z for other upward axes.

    Returns
    -------
    Clip
        Motion of the head; `Clip.pose_at` returns the pose at any time, and `Clip.note` lists targets and
        bones that the head lacks.

    Raises
    ------
    DermisError
        For files that cannot be read, with the number of the faulty line, and for motion without any target
        or bone of the head.

    Examples
    --------
    >>> import dermis, pathlib, tempfile
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> corners = "v -80 {} -60\nv 80 0 -60\nv 80 240 0\nv -80 240 0\n"
    >>> faces = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"
    >>> for k in range(3):
    ...     _ = (folder / f"face_{k}.obj").write_text(corners.format(10 * k) + faces)
    >>> head = dermis.load_head(folder / "face_0.obj", subdivide=0)
    >>> dermis.load_motion(folder, head, fps=10).duration_s
    0.2
    """
    clip_path = checked_path(path, _ACCEPTED_FILES)
    check_options(unit_mm=unit_mm, up=up, front=front)
    fps = None if fps is None else check_frame_rate("fps", fps)
    source, clip_name = _split_clip_name(clip_path, clip)
    if is_gltf(source):
        return load_gltf_clip(source, head, clip_name)
    if clip_name is not None:
        refuse(source, "the name of a clip only with a glTF file", f"got {clip_name!r}", "Leave it out")
    if is_sequence(source):
        return load_sequence(source, head, fps, unit_mm, up, front)
    if not is_file(source):
        refuse(source, _ACCEPTED_FILES, "there is no such file", "Check the name")
    if source.suffix.lower() not in (*_TABLE_SUFFIXES, *_JSON_SUFFIXES):
        refuse(source, _ACCEPTED_FILES, f"the suffix is {source.suffix!r}", "Convert it to one of these")
    load = load_live_link if source.suffix.lower() in _TABLE_SUFFIXES else load_mediapipe
    return load(source, head, fps)


def _split_clip_name(path: Path, clip: str | None) -> tuple[Path, str | None]:
    """Split "file.glb#clip" into the path of the glTF file and the name of the clip."""
    file, sign, name = str(path).rpartition("#")
    if sign and not is_file(path) and is_gltf(file):
        return Path(file), clip or name
    return path, clip
