"""`dermis fit`: refusals before long work."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.images.io import write_image

Run = Callable[..., Any]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["nothing.png"], "nothing.png: expected"),
        (["grey.png", "--white", "white"], "--white: expected red,green,blue"),
        (["grey.png", "--suns", "4"], "suns: expected"),
        (["grey.png", "-o", "grey.png"], "grey.png: expected a folder or a free name"),
        (["grey.png", "--head", "nobody"], "nobody: expected"),
    ],
)
def test_invalid_options_are_refused(run: Run, folder: Path, words: list[str], told: str) -> None:
    write_image(folder / "grey.png", np.full((32, 32, 3), 0.5))
    ended = run("fit", *words, "--adapter", "cpu")
    assert ended.code == 2 and told in ended.stderr and ended.stderr.count("\n") == 1
    assert not list(folder.rglob("*.toml"))
