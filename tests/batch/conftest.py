"""A small data set, drawn in one process without interruption, as the reference for others."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_set import contents, drawn, read, write_spec

from dermis.apps.batch.spec import Spec


@pytest.fixture(scope="session")
def small_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with spec.toml and the files that it names."""
    folder = tmp_path_factory.mktemp("batch")
    write_spec(folder)
    return folder


@pytest.fixture(scope="session")
def small_spec(small_folder: Path) -> Spec:
    return read(small_folder / "spec.toml")


@pytest.fixture(scope="session")
def undisturbed(small_folder: Path, small_spec: Spec) -> dict[str, bytes]:
    """Return the files of the data set by name."""
    report = drawn(small_spec, small_folder / "undisturbed")
    assert report.is_complete and not report.failed
    return contents(small_folder / "undisturbed")
