"""Common setup of all tests: a private cache, strict floating point, sample data and a device on request.

`DERMIS_DATA` names the folder of sample data; tests that need it (the fixture `sample_folder` or the mark
`samples`) are skipped without it and counted at the end. `DERMIS_TEST_ADAPTER` names another adapter than
"cpu".
"""

from __future__ import annotations

import gc
import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from long_modules import LONG
from rerun_modules import RERUN

if TYPE_CHECKING:
    from dermis.gpu.device import Device

TESTS = Path(__file__).parent
_UNSET = "DERMIS_DATA is not set"


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "samples: needs the sample data that DERMIS_DATA names")
    config.addinivalue_line("markers", "photographed: commands expose and choose backgrounds by themselves")
    if os.environ.get("DERMIS_DATA"):  # a relative path must survive a test that changes folder
        os.environ["DERMIS_DATA"] = str(Path(os.environ["DERMIS_DATA"]).expanduser().resolve())


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.stem in RERUN:
            item.add_marker(pytest.mark.flaky(reruns=1, reruns_delay=1))
    test_counts = Counter(item.path for item in items)
    items.sort(key=lambda item: (_starting_rank(item.path), -test_counts[item.path]))


def _starting_rank(path: Path) -> int:
    """Return the rank of a test module in LONG, or the largest rank for all other modules."""
    name = path.relative_to(TESTS).as_posix() if path.is_relative_to(TESTS) else ""
    return LONG.index(name) if name in LONG else len(LONG)


def pytest_collection_finish(session: pytest.Session) -> None:
    gc.collect()
    gc.freeze()  # excludes modules and thousands of collected tests from all later collections


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("samples"):
        _find_samples()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    skipped = terminalreporter.stats.get("skipped", [])
    count = sum(_UNSET in str(report.longrepr) for report in skipped)
    if count:
        tests = "test" if count == 1 else "tests"
        terminalreporter.write_line(f"sample data: {count} {tests} skipped because {_UNSET}", yellow=True)


@pytest.fixture(scope="session")
def sample_folder() -> Path:
    """Return the folder of sample data; skip the test if DERMIS_DATA is not set."""
    return _find_samples()


@pytest.fixture(scope="session")
def device() -> Device:
    """Return the software adapter, opened once; a machine without one fails the test."""
    from dermis.frame import renderer

    return renderer.open_device(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


@pytest.fixture(scope="session", autouse=True)
def shared_devices() -> Iterator[None]:
    """Open each adapter once in this process, because each device compiles all of its shaders again.

    Tests that destroy a device use `separate_devices`.
    """
    from dermis.frame import renderer
    from dermis.gpu import failures
    from dermis.gpu.device import open_device

    opened: dict[str, Device] = {}

    def open_once(adapter: str = "auto") -> Device:
        if adapter not in opened or opened[adapter].is_lost:
            found = open_device(adapter)
            same = [one for one in opened.values() if one.adapter.name == found.adapter.name]
            opened[adapter] = next((one for one in same if not one.is_lost), found)
        return opened[adapter]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(renderer, "open_device", open_once)
        patch.setattr(failures, "open_device", open_once)
        yield


@pytest.fixture(scope="module")
def separate_devices(shared_devices: None) -> Iterator[None]:
    """Open a new device for each renderer."""
    from dermis.frame import renderer
    from dermis.gpu import failures
    from dermis.gpu.device import open_device

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(renderer, "open_device", open_device)
        patch.setattr(failures, "open_device", open_device)
        yield


@pytest.fixture(scope="session", autouse=True)
def private_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Use a cache folder of the tests instead of the user's; parallel processes share it."""
    folder = tmp_path_factory.getbasetemp()
    folder = (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "cache"
    folder.mkdir(mode=0o700, exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DERMIS_CACHE", str(folder))
        yield


@pytest.fixture(scope="session", autouse=True)
def few_form_factor_lines() -> Iterator[None]:
    """Compute form factors from fewer lines; tests of their accuracy use `many_form_factor_lines`."""
    from dermis.atlas import interreflection

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(interreflection, "LINE_BUNDLE_COUNT", 24)
        yield


@pytest.fixture(scope="session", autouse=True)
def small_region_maps() -> Iterator[None]:
    """Paint the regions of faces in small maps; tests of the maps themselves use `large_region_maps`."""
    from dermis.human.regions import apply

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(apply, "MIN_MAP_SIDE", 256)
        yield


@pytest.fixture
def large_region_maps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Paint the regions of faces in maps as large as those of the package."""
    from dermis.human.regions import apply

    monkeypatch.setattr(apply, "MIN_MAP_SIDE", 1024)


@pytest.fixture
def many_form_factor_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compute form factors as accurately as the package does."""
    from dermis.atlas import interreflection

    monkeypatch.setattr(interreflection, "LINE_BUNDLE_COUNT", 128)


@pytest.fixture(autouse=True)
def strict_floating_point() -> Iterator[None]:
    """Turn a division by zero, an overflow or a NaN into an error; underflow to zero is permitted."""
    before = np.seterr(divide="raise", over="raise", invalid="raise")
    yield
    np.seterr(**before)


def _find_samples() -> Path:
    named = os.environ.get("DERMIS_DATA")
    if not named:
        pytest.skip(_UNSET)
    if not Path(named).is_dir():
        pytest.fail(
            f"DERMIS_DATA: expected a folder, but {named} is none. Correct it or unset it.", pytrace=False
        )
    return Path(named)
