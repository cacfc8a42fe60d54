"""Files referenced by a mesh file; files outside the folder of the mesh file are not read."""

from __future__ import annotations

from pathlib import Path, PureWindowsPath
from urllib.parse import unquote

from dermis.base.errors import refuse
from dermis.base.reading import is_file

_MAX_PATH_LENGTH = 4096  # characters; some systems are slow to refuse longer paths


def find_referenced_file(path: Path, file_name: str) -> Path | None:
    """Return the path of an existing file that a mesh file references by name; None for a missing file.

    path : path of the mesh file
    file_name : name relative to the folder of the mesh file; Windows separators are accepted

    If there is no such file in the folder or below, the last component of the name is looked up in the
    folder.
    """
    named = PureWindowsPath(file_name.strip().strip('"'))
    for candidate in (named, PureWindowsPath(named.name)):
        file = _resolve_in_folder(path.parent, candidate)
        if file is not None and is_file(file):
            return file
    return None


def resolve_uri(path: Path, uri: str) -> Path:
    """Return the path of a file that a glTF file references by a relative URI; the file need not exist.

    Raises DermisError for a file outside the folder of the glTF file, even if a link inside the folder leads
    to it.
    """
    file = _resolve_in_folder(path.parent, PureWindowsPath(unquote(uri)))
    if file is None or ":" in uri.partition("/")[0]:
        shortened = uri if len(uri) <= 80 else f"{uri[:77]}..."
        advice = "Move it into that folder and change the reference, or export one .glb file"
        refuse(path, "files in its own folder or below", f"it references {shortened!r}", advice)
    return file


def _resolve_in_folder(folder: Path, file_name: PureWindowsPath) -> Path | None:
    """Return the resolved path of a name relative to a folder; None for a path outside the folder."""
    if len(str(file_name)) > _MAX_PATH_LENGTH:
        return None
    try:
        root = folder.resolve()
        file = root.joinpath(*file_name.parts).resolve()
    except (OSError, ValueError):  # too long, a NUL, or circular links
        return None
    return None if file_name.anchor or not file.is_relative_to(root) else file
