"""Checks that results are finite."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from adversity.case import NAN, WRONG, FoundError
from pydantic import BaseModel

_BRIGHTEST = 1e12  # of radiance


def check_finite(value: Any, where: str) -> None:
    """Raise `FoundError` for a number in a tree of values, arrays and records that is not finite.

    where : name of the value in messages
    """
    if isinstance(value, float | np.floating | np.ndarray):
        array = np.asarray(value)
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise FoundError(NAN, f"{where} holds {array[~np.isfinite(array)].ravel()[0]}")
    elif isinstance(value, Mapping):
        for key, one in value.items():
            check_finite(one, f"{where}.{key}")
    elif isinstance(value, list | tuple):
        for one in value:
            check_finite(one, where)
    elif isinstance(value, BaseModel):
        check_finite(dict(value), where)
    elif is_dataclass(value) and not isinstance(value, type):
        for one in fields(value):
            check_finite(getattr(value, one.name), f"{where}.{one.name}")


def check_picture(path: Path) -> None:
    """Raise `FoundError` for a written picture that cannot be read or whose pixels are not radiance."""
    from dermis.base.errors import DermisError
    from dermis.images.io import read_image

    try:
        image = read_image(path)
    except DermisError as refusal:
        raise FoundError(WRONG, f"{path.name} cannot be read back: {refusal}") from None
    check_finite(image, path.name)
    if image.dtype.kind == "f" and not (image.min() >= 0 and image.max() < _BRIGHTEST):
        raise FoundError(WRONG, f"{path.name} has pixels from {image.min():g} to {image.max():g}")


def check_equal(made: Any, truth: Any, where: str) -> None:
    """Raise `FoundError` if two arrays differ in a single bit."""
    a, b = np.asarray(made), np.asarray(truth)
    if a.dtype != b.dtype or a.shape != b.shape or a.tobytes() != b.tobytes():
        raise FoundError(WRONG, f"{where} is not what it was made as")
