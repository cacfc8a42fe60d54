"""File formats of shards: tar files, and folders. In both, the last file is a manifest."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import tarfile
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import BinaryIO, NamedTuple

from dermis.apps.batch.atomic_files import flush_to_disk
from dermis.base.reading import parse_json, read_file, refuse_parse_errors
from dermis.base.version import version
from dermis.images.sizes import MAX_FILE_BYTES

MANIFEST_NAME = "__whole__"
"""Name of a shard's last file; the library webdataset ignores names of this form."""
MAX_MANIFEST_BYTES = 1 << 20
_MANIFEST_DESCRIPTION = "the manifest of a complete shard"


@dataclass(frozen=True)
class ShardManifest:
    """Manifest that is written last into a shard, and so proves that the shard is complete.

    spec : SHA-256 of the spec
    index : number of the shard
    first, stop : first image number, and the number after the last image
    left_out : numbers of the images that could not be rendered, with the reasons
    sha256 : SHA-256 of all bytes before the manifest
    made_with : graphics adapter and software versions with which the images were rendered
    """

    spec: str
    index: int
    first: int
    stop: int
    left_out: tuple[tuple[int, str], ...] = ()
    sha256: str = ""
    made_with: dict[str, str] = field(default_factory=dict)

    def to_bytes(self) -> bytes:
        """Return the manifest as JSON; the last entry is a hash of the entries before it."""
        values = asdict(self)
        check = hashlib.sha256(json.dumps(values).encode()).hexdigest()
        return (json.dumps({**values, "check": check}, indent=1) + "\n").encode()


def parse_manifest(json_bytes: bytes, error_subject: object) -> ShardManifest:
    """Return the manifest in the bytes of a manifest file.

    error_subject : name of the shard in error messages

    Raises DermisError if the bytes are not a manifest, or do not match the hash in the manifest.
    """
    values = parse_json(json_bytes, error_subject, _MANIFEST_DESCRIPTION)
    with refuse_parse_errors(error_subject, _MANIFEST_DESCRIPTION, KeyError, TypeError, AttributeError):
        index, first, stop = (values[name] for name in ("index", "first", "stop"))
        left_out = tuple((number, reason) for number, reason in values["left_out"])
        spec, sha256, made = values["spec"], values["sha256"], values["made_with"]
        numbers = [index, first, stop, *(number for number, _ in left_out)]
        texts = [spec, sha256, *made, *made.values(), *(reason for _, reason in left_out)]
        valid = all(type(one) is int and one >= 0 for one in numbers)
        if not valid or not all(isinstance(text, str) for text in texts):
            raise ValueError("its values have other types")
        manifest = ShardManifest(spec, index, first, stop, left_out, sha256, dict(made))
        if manifest.to_bytes() != json_bytes:
            raise ValueError("its hash does not match its content")
        return manifest


@cache
def software_versions(adapter: str) -> dict[str, str]:
    """Return the adapter's name and the versions of the software used for rendering, for the manifest."""
    versions = {"dermis": version(), "wgpu": metadata.version("wgpu"), "python": platform.python_version()}
    return {"adapter": adapter, **versions}


_TAR_BLOCK_BYTES = 512
_TAR_END_MARKER = bytes(2 * _TAR_BLOCK_BYTES)
_READ_CHUNK_BYTES = 1 << 20


class TarWriter:
    """Writer of a tar file whose entries have a constant time, owner and mode, for reproducible bytes."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("xb")
        self._hash = hashlib.sha256()

    def add(self, file_name: str, file_content: bytes) -> None:
        """Append a file to the archive; raises OSError if the disk is full."""
        for piece in _tar_entry(file_name, file_content):
            self._file.write(piece)
            self._hash.update(piece)

    def sha256(self) -> str:
        """Return the SHA-256 of all bytes written so far."""
        return self._hash.hexdigest()

    def finish(self, manifest_bytes: bytes) -> None:
        """Append the manifest, flush the archive to the disk and close it."""
        self.add(MANIFEST_NAME, manifest_bytes)
        self._file.write(_TAR_END_MARKER)
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()

    def close(self) -> None:
        """Close the archive without a manifest, as after an error."""
        self._file.close()


class TarMember(NamedTuple):
    """File in a tar archive: its name, and the offset and size of its content [bytes]."""

    name: str
    offset: int
    size: int


def tar_members(tar_file: BinaryIO) -> Iterator[TarMember]:
    """Yield the entries of a tar archive, without reading their content.

    Raises ValueError if the archive is damaged or truncated, or contains anything but regular files.
    """
    length, offset = tar_file.seek(0, os.SEEK_END), 0
    while True:
        tar_file.seek(offset)
        block = tar_file.read(_TAR_BLOCK_BYTES)
        if block == bytes(_TAR_BLOCK_BYTES):
            return
        member = _parse_header(block, offset)
        offset = member.offset + member.size + -member.size % _TAR_BLOCK_BYTES
        if offset > length:
            raise ValueError("it is truncated")
        yield member


def read_tar_manifest(tar_file: BinaryIO) -> tuple[int, bytes]:
    """Return the offset and the bytes of the manifest at the end of a tar file.

    Raises ValueError if there is no manifest, or if other bytes follow the manifest.
    """
    length = tar_file.seek(0, os.SEEK_END)
    start = max(0, length - MAX_MANIFEST_BYTES - 3 * _TAR_BLOCK_BYTES)
    tar_file.seek(start)
    tail = tar_file.read()
    header = tail.rfind(MANIFEST_NAME.encode() + b"\0")
    if header < 0 or (start + header) % _TAR_BLOCK_BYTES:
        raise ValueError("it is truncated")
    member = _parse_header(tail[header : header + _TAR_BLOCK_BYTES], start + header)
    manifest = tail[member.offset - start :][: member.size]
    if tail[header:] != b"".join(_tar_entry(MANIFEST_NAME, manifest)) + _TAR_END_MARKER:
        raise ValueError("it is truncated or damaged")
    return start + header, manifest


def tar_sha256(tar_file: BinaryIO, byte_count: int) -> str:
    """Return the SHA-256 of the first bytes of a tar file.

    byte_count : offset at which the manifest starts [bytes]
    """
    digest = hashlib.sha256()
    tar_file.seek(0)
    while byte_count > 0 and (piece := tar_file.read(min(_READ_CHUNK_BYTES, byte_count))):
        digest.update(piece)
        byte_count -= len(piece)
    return digest.hexdigest()


def _tar_entry(file_name: str, file_content: bytes) -> tuple[bytes, bytes, bytes]:
    """Return the three parts of a file in a tar archive: header, content, and padding to the block size."""
    head = tarfile.TarInfo(file_name)
    head.size = len(file_content)
    return head.tobuf(tarfile.USTAR_FORMAT), file_content, bytes(-len(file_content) % _TAR_BLOCK_BYTES)


def _parse_header(header_block: bytes, offset: int) -> TarMember:
    try:
        head = tarfile.TarInfo.frombuf(header_block, "utf-8", "strict")
    except (tarfile.HeaderError, UnicodeDecodeError) as fault:
        raise ValueError(f"its header at byte {offset} is damaged") from fault
    if head.type not in (tarfile.REGTYPE, tarfile.AREGTYPE) or head.size < 0:
        raise ValueError(f"it contains {head.name[:60]!r}, which is not a regular file")
    return TarMember(head.name, offset + _TAR_BLOCK_BYTES, head.size)


class FolderWriter:
    """Writer of the files of a shard into a folder, with the methods of `TarWriter`."""

    def __init__(self, path: Path) -> None:
        path.mkdir()
        self._path, self._hash = path, hashlib.sha256()

    def add(self, file_name: str, file_content: bytes) -> None:
        """Write a file into the folder; raises OSError if the disk is full."""
        with (self._path / file_name).open("xb") as file:
            file.write(file_content)
        self._hash.update(_file_hash_input(file_name, file_content))

    def sha256(self) -> str:
        """Return the SHA-256 of all names and contents written so far."""
        return self._hash.hexdigest()

    def finish(self, manifest_bytes: bytes) -> None:
        """Write the manifest; its hash will show whether files were lost in a power failure."""
        self.add(MANIFEST_NAME, manifest_bytes)
        flush_to_disk(self._path / MANIFEST_NAME)
        flush_to_disk(self._path)

    def close(self) -> None:
        """Do nothing, as no file is open."""


def folder_sha256(folder: Path, file_names: Iterable[str]) -> str:
    """Return the SHA-256 of the named files in a folder, computed in the same way as `FolderWriter.sha256`.

    Raises DermisError if a file cannot be read.
    """
    digest = hashlib.sha256()
    for name in file_names:
        digest.update(_file_hash_input(name, read_file(folder / name, "a file of a shard", MAX_FILE_BYTES)))
    return digest.hexdigest()


def _file_hash_input(file_name: str, file_content: bytes) -> bytes:
    """Return the bytes that are hashed for a file of a folder: its name, size and content."""
    return f"{file_name} {len(file_content)}\n".encode() + file_content
