"""The figure of `dermis profile --plot`: its contents, and errors of the disk."""

from __future__ import annotations

import errno
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

Run = Callable[..., Any]
Drawn = Callable[..., Figure]


@pytest.fixture
def drawn(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Drawn:
    """Return the figure that `dermis profile` makes with the given arguments."""
    figures: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: figures.append(self))

    def call(*words: object) -> Figure:
        assert run("profile", *words, "--plot", "a.png").code == 0
        return figures[-1]

    return call


def legend(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_spectra_of_a_skin_of_pigments(drawn: Drawn) -> None:
    figure = drawn("light", "--fit", 2)
    _, spectrum, coefficients = figure.axes
    assert [line.get_label() for line in spectrum.lines] == ["R"]
    assert [line.get_label() for line in coefficients.lines] == [
        "µa, epidermis", "µs′, epidermis", "µa, dermis", "µs′, dermis"
    ]  # fmt: skip
    assert len(drawn("skin1", "--fit", 2).axes) == 1


def test_model_and_its_fit_in_each_colour(drawn: Drawn) -> None:
    figure = drawn("skin1", "--fit", 3, "--fit-kind", "burley")
    entries = legend(figure)
    assert [entry.partition(",")[0] for entry in entries] == 3 * ["red"] + 3 * ["green"] + 3 * ["blue"]
    assert entries[0] == "red, counted" and entries[1].startswith("red, 3 Gaussians, error ")
    assert entries[2].startswith("red, Burley")
    assert len(figure.axes[0].lines) == 9 and not figure.axes[0].containers


def test_own_widths_are_counted_per_channel(drawn: Drawn) -> None:
    assert "green, 2 Gaussians" in " ".join(legend(drawn("skin1", "--fit", 2, "--variances", "per-channel")))


@pytest.mark.parametrize("words", [("--model", "montecarlo"), ("--check",)])
def test_photons_have_error_bars(drawn: Drawn, words: tuple[str, ...]) -> None:
    axes = drawn("skin1", "--photons", 5000, *words).axes[0]
    assert len(axes.containers) == 3 and all(bars.has_yerr for bars in axes.containers)


@pytest.mark.filterwarnings("error")
def test_photons_too_few_to_draw_leave_the_fit(run: Run, folder: Path) -> None:
    ended = run("profile", "skin1", "--model", "montecarlo", "--photons", 20, "--plot", "a.png")
    assert ended.code == 0 and (folder / "a.png").exists()


def test_disk_that_fills_up(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For every format, because all are rendered in memory first."""
    whole = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        whole(path, data[: len(data) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    before = sorted(folder.iterdir())
    for name in ("a.png", "a.svg", "a.pdf"):
        ended = run("profile", "skin1", "--plot", name)
        assert (ended.code, ended.stdout) == (2, "") and "No space left" in ended.stderr
        assert sorted(folder.iterdir()) == before
