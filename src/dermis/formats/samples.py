"""Sample heads and environments, downloaded once and verified by their hashes."""

from __future__ import annotations

import hashlib
import os
import stat
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NoReturn

from dermis.base.errors import DermisError, refuse
from dermis.base.private import cache_folder, make_private_folder

DATA_VARIABLE = "DERMIS_DATA"


@dataclass(frozen=True)
class SampleFile:
    """File of a sample: its name, public URL and expected SHA-256."""

    name: str
    url: str
    sha256: str


@dataclass(frozen=True)
class Sample:
    """Files, licence and units of a sample.

    kind : "head" for a mesh with maps, "environment" for a latitude-longitude picture
    folder : name of the folder of the sample below DERMIS_DATA, or below the cache
    files : dictionary from role (mesh, colour, specular, normal, height, licence or environment) to file
    licence : terms of use
    attribution : authors to credit
    unit_mm : length of one unit of the mesh [mm]
    v_origin : edge of the maps where v = 0, "top" or "bottom"
    height_mm : height difference of one grey level of the 8-bit height map [mm]
    """

    name: str
    kind: Literal["head", "environment"]
    folder: str
    files: Mapping[str, SampleFile]
    licence: str
    attribution: str
    unit_mm: float | None = None
    v_origin: Literal["top", "bottom"] | None = None
    height_mm: float | None = None


def _load_sample_registry() -> Mapping[str, Sample]:
    text = resources.files(__package__).joinpath("samples.toml").read_text("utf-8")
    return MappingProxyType({name: _parse_sample(name, entry) for name, entry in tomllib.loads(text).items()})


def _parse_sample(sample_name: str, sample_table: dict[str, Any]) -> Sample:
    home, listed = sample_table.pop("home"), sample_table.pop("files")
    files = {role: SampleFile(**file, url=home + file["name"]) for role, file in listed.items()}
    return Sample(name=sample_name, files=MappingProxyType(files), **sample_table)


SAMPLES = _load_sample_registry()


def fetch_sample(name: str) -> dict[str, Path]:
    """Return the paths of a sample's files by role; missing files are downloaded.

    name : a key of `SAMPLES`

    If DERMIS_DATA is set, the folder that it names must contain the files, and nothing is downloaded.

    Raises DermisError for an unknown sample, for a failed download, and for a file with an unexpected hash.
    """
    sample = _find_sample(name)
    paths = {role: _sample_folder(sample) / file.name for role, file in sample.files.items()}
    missing = [role for role, file in sample.files.items() if not _has_expected_hash(paths[role], file)]
    if missing and _data_folder():
        _refuse_sample_file(paths[missing[0]])
    if missing:
        _download_files(sample, missing)
    return paths


def is_available(name: str) -> bool:
    """Return whether all files of a sample exist locally.

    name : a key of `SAMPLES`
    """
    sample = _find_sample(name)
    folder = _sample_folder(sample)
    return all(_has_expected_hash(folder / file.name, file) for file in sample.files.values())


def _find_sample(sample_name: str) -> Sample:
    if sample_name not in SAMPLES:
        refuse(
            f"sample {sample_name!r}", f"one of {', '.join(SAMPLES)}", "it is unknown", "Choose one of them"
        )
    return SAMPLES[sample_name]


def _data_folder() -> str:
    return os.environ.get(DATA_VARIABLE, "")


def _sample_folder(sample: Sample) -> Path:
    base = _data_folder() or cache_folder() / "samples"
    return Path(base) / sample.folder


def _has_expected_hash(path: Path, sample_file: SampleFile) -> bool:
    """Return whether a file exists and has the expected SHA-256."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):  # a pipe would block the reader
            return False
        return _file_sha256(path, status.st_size, status.st_mtime_ns) == sample_file.sha256
    except OSError:
        return False


@lru_cache(maxsize=256)
def _file_sha256(path: Path, byte_count: int, mtime_ns: int) -> str:
    """Return the SHA-256 of a file, from a cache if its size and modification time are unchanged."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _download_files(sample: Sample, roles: list[str]) -> None:
    import pooch

    folder = _sample_folder(sample)
    for count, role in enumerate(roles):
        file, progress = sample.files[role], _DownloadProgress(sample.files[role].name)
        downloader = pooch.HTTPDownloader(progressbar=progress, timeout=30)
        try:
            make_private_folder(folder)
            if not (path := folder / file.name).is_file():
                path.unlink(missing_ok=True)  # pooch would read from a pipe
            pooch.retrieve(file.url, f"sha256:{file.sha256}", file.name, folder, downloader=downloader)
        except (OSError, ValueError) as fault:  # no network, no permission; another hash
            _refuse_download(sample, roles[count:], fault)
        finally:
            progress.stop()


class _DownloadProgress:
    """Progress bar of a download on stderr, with the interface that pooch expects."""

    def __init__(self, name: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn

        text, console = TextColumn("{task.description}"), Console(stderr=True)
        self._bars = Progress(text, BarColumn(), DownloadColumn(), console=console)
        self._task = self._bars.add_task(name, total=None)
        self.total = 0

    def update(self, byte_count: int) -> None:
        self._bars.start()
        self._bars.update(self._task, total=self.total or None, advance=byte_count)

    def reset(self) -> None:
        self._bars.reset(self._task)

    def close(self) -> None:
        """Do nothing; pooch requires this method.

        `stop` removes the progress bar instead, because pooch does not call `close` if a download fails.
        """

    def stop(self) -> None:
        if self._bars.live.is_started:
            self._bars.stop()


def _refuse_sample_file(path: Path) -> NoReturn:
    actual = "it is another file (its sha256 differs)" if path.is_file() else "it is not there"
    advice = f"Put it there, or unset {DATA_VARIABLE} so that the samples are downloaded"
    refuse(path, f"a file of the sample data below {DATA_VARIABLE}", actual, advice)


def _refuse_download(sample: Sample, roles: list[str], fault: Exception) -> NoReturn:
    if isinstance(fault, OSError):
        reason = f"it failed ({fault.strerror or type(fault).__name__})"
    else:
        reason = "the file has changed (its sha256 differs)"
    urls = "\n".join(f"  {sample.files[role].url}" for role in roles)
    raise DermisError(
        f"sample {sample.name!r}: expected to download it, but {reason}. "
        f"Download these files manually:\n{urls}\n"
        f"into {_sample_folder(sample)}, or into FOLDER/{sample.folder} with {DATA_VARIABLE}=FOLDER set."
    ) from fault
