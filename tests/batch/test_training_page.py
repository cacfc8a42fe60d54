"""The code of the page about training runs on a few small images, where PyTorch and JAX are installed."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dermis.dataset
from dermis.dataset import export_keypoints
from dermis.images.io import write_png

PAGE = Path(__file__).resolve().parents[2] / "docs" / "training.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
SPEC = """
size = [48, 48]
images_per_person = 4
[render]
atlas = 64
samples = 1
shadow_size = 64
transmission = "none"
[person]
head = "human"
[camera]
yaw_deg = {uniform = [-20, 20]}
"""


def small(code: str) -> str:
    """Return code of the page with fewer and smaller steps."""
    code = code.replace("96, 68, 60", "32, 68, 2").replace("batch_size=8", "batch_size=2")
    return code.replace("itertools.islice(images, 8)", "itertools.islice(images, 2)")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the working folder, with a spec and annotated pictures."""
    (tmp_path / "spec.toml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_annotated_pictures(folder: Path) -> None:
    """Write pictures of a stream with their points, as a user's own."""
    images = dermis.dataset.stream(SPEC and folder / "spec.toml", adapter="cpu")
    for k, one in enumerate(itertools.islice(images, 3)):
        target = folder / "mine" / ("train" if k < 2 else "test")
        target.mkdir(parents=True, exist_ok=True)
        write_png(target / f"{k}.png", one["picture"])
        rows = "".join(f"{x + 1} {y + 1}\n" for x, y in one["landmarks.ibug-68.pixels"])
        (target / f"{k}.pts").write_text(f"version: 1\nn_points: 68\n{{\n{rows}}}\n")
    images.close()  # type: ignore[attr-defined]


def test_the_protocol_runs_with_torch(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("torch")
    write_annotated_pictures(folder)
    names: dict[str, Any] = {}
    for block in BLOCKS:
        if "jax" not in block:
            exec(small(block), names)
    names["batches"].close() if hasattr(names["batches"], "close") else None
    told = capsys.readouterr().out
    assert "% of the time waiting" in told and "normalised mean error" in told
    batch = names["batch"]
    assert tuple(batch["picture"].shape) == (2, 48, 48, 3) and len(batch["landmarks.ibug-68.pixels"]) == 2
    crops = names["crop"](batch["picture"], names["torch"].tensor([[23.5, 23.5, 24.0]] * 2))
    mean = batch["picture"].float().mean(dim=(1, 2)) / 255
    assert np.allclose(crops.mean(dim=(2, 3)), mean, atol=0.03), (
        "the crop of the whole picture is the picture"
    )


def test_the_stream_feeds_jax(folder: Path) -> None:
    pytest.importorskip("jax")
    names: dict[str, Any] = {}
    (block,) = [block for block in BLOCKS if "jax" in block]
    exec(small(block), names)
    assert names["batch"]["picture"].shape == (2, 48, 48, 3)


def test_the_page_names_functions_that_exist() -> None:
    assert callable(export_keypoints) and len(BLOCKS) == 5
    for name in re.findall(r"\bdataset\.(\w+)\(", PAGE.read_text("utf-8")):
        assert hasattr(dermis.dataset, name), name
    for block in BLOCKS:
        compile(block, str(PAGE), "exec")
