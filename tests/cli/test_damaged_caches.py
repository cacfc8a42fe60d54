"""A damaged cache gives the same picture bit for bit, and is repaired."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., Any]


def _spoil(path: Path, how: int) -> None:
    data = path.read_bytes()
    match how % 5:
        case 0:
            path.write_bytes(
                data[: len(data) // 2] + bytes([data[len(data) // 2] ^ 16]) + data[len(data) // 2 + 1 :]
            )
        case 1:
            path.write_bytes(data[:-7])
        case 2:
            path.write_bytes(b"")
        case 3:
            path.unlink()
            path.symlink_to("nowhere")
        case 4:
            path.unlink()
            os.mkfifo(path)


@pytest.mark.skipif(os.name != "posix", reason="pipes with names are POSIX's")
def test_a_damaged_cache_changes_no_picture(
    render: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("head.obj", "-o")
    for cache in ("other", "cache"):
        monkeypatch.setenv("DERMIS_CACHE", str(folder / cache))
        begun = render(*words, "first.png")
    first = (folder / "first.png").read_bytes()
    # Those that both have: a thread that another test left may put something of its own into one.
    own = {path.name for path in (folder / "other").rglob("*.arrays")}
    kept = {path: path.read_bytes() for path in (folder / "cache").rglob("*.arrays") if path.name in own}
    assert len(kept) > 1
    for shift in (0, 2, 4):
        for number, path in enumerate(kept):
            _spoil(path, number + shift)
        ended = render(*words, "again.png")
        assert (ended.code, ended.stderr) == (0, begun.stderr)
        assert (folder / "again.png").read_bytes() == first
        whole = {path: len(path.read_bytes()) for path in kept}
        assert whole == {path: len(data) for path, data in kept.items()}
    monkeypatch.setenv("DERMIS_CACHE", os.devnull)
    assert render(*words, "without.png").code == 0
    assert (folder / "without.png").read_bytes() == first
