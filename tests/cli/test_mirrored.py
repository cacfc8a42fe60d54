"""A head whose halves share one uv is rendered, and a note says what is wrong with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_head import obj_text

from dermis.cli import main


def test_mirrored_uv_is_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folded = []
    for line in obj_text().splitlines():
        if line.startswith("vt "):
            u, v = (float(word) for word in line.split()[1:3])
            line = f"vt {1 - abs(2 * u - 1):.6f} {v:.6f}"
        folded.append(line)
    (tmp_path / "folded.obj").write_text("\n".join(folded) + "\n", encoding="utf-8")
    output = tmp_path / "out.png"
    words = ["dermis", "render", str(tmp_path / "folded.obj"), "-o", str(output), "--size", "32x32"]
    monkeypatch.setattr("sys.argv", [*words, "--atlas", "256", "--samples", "1", "--adapter", "cpu"])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 0
    noted = capsys.readouterr().err
    assert "without scattering" in noted
    share = int(noted.split("note: ")[1].split("%")[0])
    assert np.isclose(share, 50, atol=15)
