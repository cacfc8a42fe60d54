"""Registry of samples, and downloads that are verified by hash."""

from __future__ import annotations

import hashlib
import os
import re
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import MappingProxyType

import pytest

from dermis.base.errors import DermisError
from dermis.formats import samples
from dermis.formats.samples import SAMPLES, Sample, SampleFile, fetch_sample, is_available

CONTENT = b"a small environment"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty cache folder, without DERMIS_DATA."""
    monkeypatch.delenv("DERMIS_DATA", raising=False)
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path / "cache" / "dermis"))
    return tmp_path / "cache" / "dermis" / "samples"


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a DERMIS_DATA folder in which lebombo is another file."""
    (tmp_path / "env").mkdir()
    (tmp_path / "env" / "lebombo_1k.hdr").write_bytes(b"#?RADIANCE but not that one")
    monkeypatch.setenv("DERMIS_DATA", str(tmp_path))
    return tmp_path


def _sample(url: str, content: bytes = CONTENT) -> Sample:
    file = SampleFile("tiny.hdr", url, hashlib.sha256(content).hexdigest())
    return Sample("tiny", "environment", "env", {"environment": file}, "CC0", "nobody")


def _register(monkeypatch: pytest.MonkeyPatch, sample: Sample) -> None:
    monkeypatch.setattr(samples, "SAMPLES", MappingProxyType({sample.name: sample}))


@pytest.fixture
def home(tmp_path: Path) -> Iterator[str]:
    """Yield the address of a local server with tiny.hdr."""

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "tiny.hdr").write_bytes(CONTENT)
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(tmp_path / "home")))
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


def test_registry_is_well_formed() -> None:
    for name, sample in SAMPLES.items():
        assert sample.name == name
        assert sample.kind in ("head", "environment")
        assert sample.licence
        assert sample.attribution
        for file in sample.files.values():
            assert file.url.startswith("https://")
            assert file.url.endswith(f"/{file.name}")
            assert re.fullmatch("[0-9a-f]{64}", file.sha256)


def test_heads_state_their_unit_and_axes() -> None:
    head = SAMPLES["lee_perry_smith"]
    assert (head.unit_mm, head.v_origin, head.height_mm) == (50.35, "bottom", 0.025)
    assert set(head.files) == {"mesh", "colour", "specular", "normal", "height", "licence"}
    assert "Lee Perry-Smith" in head.attribution


def test_registry_cannot_be_changed() -> None:
    with pytest.raises(TypeError):
        SAMPLES["mine"] = SAMPLES["lebombo"]  # type: ignore[index]
    with pytest.raises(TypeError):
        SAMPLES["lebombo"].files["mine"] = None  # type: ignore[index]


def test_unknown_sample_is_refused_with_known_ones_listed() -> None:
    for ask in (fetch_sample, is_available):
        with pytest.raises(DermisError, match=r"'mine'.*lee_perry_smith, royal_esplanade, lebombo"):
            ask("mine")


@pytest.mark.usefixtures("data")
def test_other_file_in_the_data_folder_is_refused() -> None:
    assert not is_available("lebombo")
    with pytest.raises(DermisError, match=r"lebombo_1k\.hdr.*differs"):
        fetch_sample("lebombo")


@pytest.mark.usefixtures("data")
def test_missing_file_in_the_data_folder_is_refused() -> None:
    assert not is_available("royal_esplanade")
    with pytest.raises(DermisError, match=r"royal_esplanade_1k\.hdr.*not there"):
        fetch_sample("royal_esplanade")


def test_offline_says_how_to_get_the_files(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pooch
    import requests

    def no_network(*_: object) -> None:
        raise requests.exceptions.ConnectionError("no route to host")

    monkeypatch.setattr(pooch.HTTPDownloader, "__call__", no_network)
    assert not is_available("lee_perry_smith")
    with pytest.raises(DermisError) as caught:
        fetch_sample("lee_perry_smith")
    message = str(caught.value)
    assert all(file.url in message for file in SAMPLES["lee_perry_smith"].files.values())
    assert "DERMIS_DATA=" in message
    assert str(cache / "heads" / "lee_perry_smith") in message
    assert not [path for path in cache.rglob("*") if path.is_file()]


def test_download_is_kept(
    cache: Path, home: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import pooch

    _register(monkeypatch, _sample(f"{home}/tiny.hdr"))
    paths = fetch_sample("tiny")
    assert paths == {"environment": cache / "env" / "tiny.hdr"}
    assert paths["environment"].read_bytes() == CONTENT
    shown = capsys.readouterr()
    assert "tiny.hdr" in shown.err
    assert shown.out == ""
    monkeypatch.delattr(pooch, "retrieve")  # from here on, no network
    assert is_available("tiny")
    assert fetch_sample("tiny") == paths


@pytest.mark.parametrize("damage", ["cut", "a link to nowhere", "a pipe"])
def test_damaged_file_in_the_cache_is_fetched_again(
    cache: Path, home: str, damage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _register(monkeypatch, _sample(f"{home}/tiny.hdr"))
    file = cache / "env" / "tiny.hdr"
    file.parent.mkdir(parents=True)
    if damage == "cut":
        file.write_bytes(CONTENT[:5])
    elif damage == "a pipe" and hasattr(os, "mkfifo"):
        os.mkfifo(file)
    else:
        file.symlink_to("nowhere")
    assert not is_available("tiny")
    assert fetch_sample("tiny")["environment"].read_bytes() == CONTENT


def test_changed_file_at_its_source_is_refused(
    cache: Path, home: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _register(monkeypatch, _sample(f"{home}/tiny.hdr", content=b"what it was"))
    with pytest.raises(DermisError, match="the file has changed"):
        fetch_sample("tiny")
    assert not (cache / "env" / "tiny.hdr").exists()


def test_file_missing_at_its_source_is_refused(
    cache: Path, home: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _register(monkeypatch, _sample(f"{home}/gone/tiny.hdr"))
    with pytest.raises(DermisError, match=r"(?s)HTTPError.*gone/tiny\.hdr"):
        fetch_sample("tiny")


@pytest.mark.skipif(not os.environ.get("DERMIS_DATA"), reason="DERMIS_DATA is not set")
@pytest.mark.parametrize("name", SAMPLES)
def test_data_folder_has_every_sample(name: str) -> None:
    assert is_available(name)
    assert all(path.is_file() for path in fetch_sample(name).values())
