"""Raw figures as JSON, written whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from dermis.base.atomic_write import replacing


def write_figures(path: Path, told: dict[str, Any], digits: int) -> None:
    """Write them.

    digits : of floats, as many as mean something
    """
    with replacing(path) as unfinished:
        unfinished.write_text(json.dumps(_rounded(told, digits), indent=1) + "\n", encoding="utf-8")


def _rounded(value: Any, digits: int) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{digits}g}")
    if isinstance(value, dict):
        return {str(key): _rounded(one, digits) for key, one in value.items()}
    return [_rounded(one, digits) for one in value] if isinstance(value, list | tuple) else value
