"""The single entry point for files written by others."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from dermis.base.errors import DermisError
from dermis.base.reading import parse_json, read_file, read_text, read_toml

_MOST = 1000


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/stdin", "/proc/kcore", "/", "a\0b", "a" * 5000])
def test_non_regular_file_is_refused_at_once(device: str) -> None:
    with pytest.raises(DermisError, match=r"expected a table"):
        read_file(device, "a table", _MOST)


def test_a_pipe_without_a_writer_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(DermisError, match="not a regular file"):
        read_file(tmp_path / "pipe", "a table", _MOST)


def test_read_size_is_limited_by_file_type(tmp_path: Path) -> None:
    path = tmp_path / "table"
    path.write_bytes(bytes(_MOST))
    assert read_file(path, "a table", _MOST) == bytes(_MOST)
    with path.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(DermisError, match="at most 1,000 bytes"):
        read_file(path, "a table", _MOST)


@pytest.mark.skipif(not Path("/proc/kallsyms").exists(), reason="no such file of the system")
def test_growing_file_of_unknown_size_is_refused() -> None:
    with pytest.raises(DermisError, match="grows while it is read"):
        read_file("/proc/kallsyms", "a table", 1 << 30)


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 5000, "a = " + "1" * 5000, "a =", "\xff", "a = 1\na = 2"], ids=range(5)
)
def test_invalid_toml_names_the_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(DermisError, match=r"scene\.toml: expected a TOML file, but"):
        read_toml(path)


@pytest.mark.parametrize("text", ["[" * 100000, "1" * 5000, "1e999", "NaN", "-Infinity", "{"], ids=range(6))
def test_invalid_json_names_its_source(text: str) -> None:
    with pytest.raises(DermisError, match="message: expected an event, but"):
        parse_json(text, "message", "an event")


def test_byte_order_mark_is_skipped(tmp_path: Path) -> None:
    path = tmp_path / "clip.csv"
    path.write_bytes(b"\xef\xbb\xbfname")
    assert read_text(path, "a clip") == "name"
