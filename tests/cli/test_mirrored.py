"""A head whose halves share one uv: each half gets its own charts, except with the mesh's own layout."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_head import obj_text, without_colour_note

from dermis.cli import main


@pytest.fixture
def folded(tmp_path: Path) -> Path:
    """Return the path of a head whose uv is folded along the middle."""
    lines = []
    for line in obj_text().splitlines():
        if line.startswith("vt "):
            u, v = (float(word) for word in line.split()[1:3])
            line = f"vt {1 - abs(2 * u - 1):.6f} {v:.6f}"
        lines.append(line)
    path = tmp_path / "folded.obj"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("seams", ["stitch", "alpha"])
def test_mirrored_uv_gives_the_same_picture(
    folded: Path, seams: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["dermis", "render", str(folded), "-o", str(folded.with_suffix(".png")), "--size", "32x32"]
    quick = ["--atlas", "256", "--samples", "1", "--adapter", "cpu", "--seams", seams]
    monkeypatch.setattr("sys.argv", [*words, *quick])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 0
    noted = without_colour_note(capsys.readouterr().err)
    assert ("without scattering" in noted) == (seams == "alpha")
    if seams == "alpha":
        share = int(noted.split("note: ")[1].split("%")[0])
        assert np.isclose(share, 50, atol=15)
