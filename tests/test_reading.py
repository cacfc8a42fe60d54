"""The single entry point for files written by others."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from dermis.base.errors import DermisError
from dermis.base.reading import parse_json, read_file, read_text, read_toml

_MOST = 1000


@pytest.mark.parametrize(
    "device", ["/dev/zero", "/dev/stdin", "/proc/kmsg", "/proc/kcore", "/", "a\0b", "a" * 5000]
)
def test_no_regular_file_is_refused_at_once(device: str) -> None:
    with pytest.raises(DermisError, match=r"expected a table"):
        read_file(device, "a table", _MOST)


def test_a_pipe_without_a_writer_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(DermisError, match="not a regular file"):
        read_file(tmp_path / "pipe", "a table", _MOST)


def test_no_more_is_read_than_the_kind_may_have(tmp_path: Path) -> None:
    path = tmp_path / "table"
    path.write_bytes(bytes(_MOST))
    assert read_file(path, "a table", _MOST) == bytes(_MOST)
    with path.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(DermisError, match="at most 1,000 bytes"):
        read_file(path, "a table", _MOST)


@pytest.mark.skipif(not Path("/proc/kallsyms").exists(), reason="no such file of the system")
def test_a_file_that_tells_no_size_is_not_cut() -> None:
    with pytest.raises(DermisError, match="grows while it is read"):
        read_file("/proc/kallsyms", "a table", 1 << 30)


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 5000, "a = " + "1" * 5000, "a =", "\xff", "a = 1\na = 2"], ids=range(5)
)
def test_toml_that_cannot_be_taken_names_the_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(DermisError, match=r"scene\.toml: expected a TOML file, but"):
        read_toml(path)


@pytest.mark.parametrize("text", ["[" * 100000, "1" * 5000, "1e999", "NaN", "-Infinity", "{"], ids=range(6))
def test_json_that_cannot_be_taken_names_its_source(text: str) -> None:
    with pytest.raises(DermisError, match="message: expected an event, but"):
        parse_json(text, "message", "an event")


def test_a_mark_of_the_byte_order_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "clip.csv"
    path.write_bytes(b"\xef\xbb\xbfname")
    assert read_text(path, "a clip") == "name"
