"""All kinds of input."""

from __future__ import annotations

import warnings
from contextlib import chdir
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np
from adversity.kind import Kind
from adversity.kinds import (
    caches,
    clips,
    commands,
    containers,
    datasets,
    frames,
    large,
    machine_code,
    meshes,
    pages,
    pictures,
    scenes,
    specs,
    spectra,
)

_PARTS = (
    meshes,
    containers,
    pictures,
    scenes,
    specs,
    spectra,
    clips,
    caches,
    machine_code,
    frames,
    datasets,
    pages,
    large,
    commands,
)
KINDS: dict[str, Kind] = {kind.name: kind for part in _PARTS for kind in part.KINDS}


def prepare(kinds: dict[str, Kind] = KINDS) -> None:
    """Process valid inputs here, so that forked processes share what they import and build."""
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for kind in (one for one in kinds.values() if not one.opens_device):
            for number in range(kind.warmed):
                with TemporaryDirectory() as folder, chdir(folder):
                    kind.take(kind.sound(Random(number)).write(Path(folder)))
