"""Files that a mesh file names, in its own folder or below it."""

from __future__ import annotations

from pathlib import Path, PureWindowsPath
from urllib.parse import unquote

from dermis.base.errors import refuse
from dermis.base.reading import is_file

_MAX_PATH_LENGTH = 4096  # characters of a path; some systems take their time to say so


def find_referenced_file(path: Path, name: str) -> Path | None:
    """The file of that name in the folder of `path` or below it; None for one that is elsewhere or nowhere.

    Names with the separators of Windows will do. Of a name that leads elsewhere the last part is looked for.
    """
    told = PureWindowsPath(name.strip().strip('"'))
    for part in (told, PureWindowsPath(told.name)):
        file = _resolve_below(path.parent, part)
        if file is not None and is_file(file):
            return file
    return None


def resolve_uri(path: Path, uri: str) -> Path:
    """The file that a glTF file names by a relative reference, be it there or not.

    Raises DermisError for one outside of the file's folder, by its name or by a link.
    """
    file = _resolve_below(path.parent, PureWindowsPath(unquote(uri)))
    if file is None or ":" in uri.partition("/")[0]:
        told = uri if len(uri) <= 80 else f"{uri[:77]}..."
        advice = "Move it into that folder and name it so, or export one .glb file"
        refuse(path, "files in its own folder or below", f"it names {told!r}", advice)
    return file


def _resolve_below(folder: Path, name: PureWindowsPath) -> Path | None:
    """The file's real place; None for what no file is called, and for what is not below the folder."""
    if len(str(name)) > _MAX_PATH_LENGTH:
        return None
    try:
        home = folder.resolve()
        file = home.joinpath(*name.parts).resolve()
    except (OSError, ValueError):  # too long, a NUL, links in a circle
        return None
    return None if name.anchor or not file.is_relative_to(home) else file
