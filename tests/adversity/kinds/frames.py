"""Numbered pictures left by an interrupted command, and the record of their digest."""

from __future__ import annotations

from pathlib import Path
from random import Random

import numpy as np
from adversity.case import WRONG, FoundError, Input, Plan
from adversity.damage import scarred
from adversity.kind import Kind
from adversity.kinds.pictures import exr_bytes

from dermis.images.codecs import encode_png

_MADE_OF = "1f" * 32
_SIZE = (12, 8)
_COUNT = 3


def _sound(rng: Random) -> Input:
    suffix = rng.choice((".png", ".exr"))
    width, height = _SIZE
    png = encode_png(np.full((height, width, 3), 90, np.uint8))
    data = png if suffix == ".png" else exr_bytes(3, height, width)
    pictures = {f"frames/{k:03}{suffix}": data for k in range(_COUNT)}
    pattern = f"frames/%03d{suffix}"
    record = {f"frames/.%03d{suffix}.made-of": _MADE_OF.encode()}
    return Input({**record, **pictures}, {"file": pattern, "error_subjects": []})


def _take(plan: Plan) -> None:
    """Resume a run: reused pictures are complete, and the record is correct."""
    from dermis.base.errors import DermisError
    from dermis.images.io import read_image
    from dermis.images.writer import FrameFiles

    files = FrameFiles(Path(plan["file"]))
    files.prepare_folder()
    files.start_sequence(_MADE_OF)
    missing = files.missing_frames(range(_COUNT), _SIZE)
    for number in set(range(_COUNT)) - set(missing):
        try:
            shape = read_image(files.path(number)).shape
        except DermisError as refusal:
            raise FoundError(WRONG, f"a frame is kept that cannot be read: {refusal}") from None
        if shape[1::-1] != _SIZE:
            raise FoundError(WRONG, f"a frame of {shape} is kept")


KINDS = (Kind("frames", _sound, _take, scarred, share=5),)
