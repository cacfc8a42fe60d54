"""Lamps in files."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from dermis.optics.lamps import band_power


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    file, ratio = tmp_path / "lamp.csv", []
    for time_s, blue in ((1, 1.0), (2, 0.25)):
        file.write_text(f"380,{blue}\n550,1\n780,1\n")
        os.utime(file, (time_s, time_s))
        power = band_power(str(file), np.array([420.0, 600.0]))
        ratio.append(power[0] / power[1])
    assert ratio[0] == 1.0 and ratio[1] < 0.5
