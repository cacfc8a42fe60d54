"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

from dermis.errors import DermisError, refuse


def check_output(path: str | Path, suffixes: Sequence[str], advice: str = "Choose one of them") -> Path:
    """The path, after a trial that a file can be written there: call it before long work.

    suffixes : what the name may end in, such as ".png"

    Raises DermisError when the name ends otherwise, or when the folder is missing or not writable.
    """
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        came = f"its suffix is {target.suffix!r}" if target.suffix else "it has no suffix"
        refuse(path, f"a name that ends in {' or '.join(suffixes)}", came, advice)
    if not target.parent.is_dir():
        refuse(path, "a folder that exists", f"there is no folder {target.parent}", "Make it first")
    if target.exists() and not target.is_file():
        refuse(path, "a file or a free name", "something else has this name", "Choose another name")
    trial = _temporary_name(target)
    try:
        trial.touch()
    except OSError as fault:
        refuse_output(path, fault)
    finally:  # also when interrupted in between
        with suppress(OSError):
            trial.unlink()
    return target


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A name in the same folder, moved to `path` when all went well and removed when not."""
    target = Path(os.path.realpath(path))
    temporary = _temporary_name(target)
    try:
        yield temporary
        temporary.replace(target)
    except BaseException as fault:
        with suppress(OSError):  # it was never made
            temporary.unlink()
        if isinstance(fault, OSError | RuntimeError):  # OpenEXR reports a full disk as a RuntimeError
            refuse_output(path, fault)
        raise


def refuse_output(path: str | Path, fault: Exception) -> NoReturn:
    """Raise the `DermisError` of a file that cannot be written."""
    raise DermisError(
        f"{path}: expected a place to write a file to, but it cannot be written ({reason(fault)}). "
        "Choose a writable folder with space left."
    ) from fault


def reason(fault: Exception) -> str:
    """A fault in one line, without the path that an OSError repeats."""
    text = getattr(fault, "strerror", None) or str(fault) or type(fault).__name__
    return text.splitlines()[0].rstrip(".")


def _temporary_name(target: Path) -> Path:
    return target.with_name(f".dermis-{secrets.token_hex(6)}{target.suffix}")
