"""Deterministic formatting of plain Python objects as TOML.

Data sets are identified by the hash of this text, so its format must not depend on a library.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any


def table_text(title: str, values: Mapping[str, Any]) -> str:
    """Return a mapping as a TOML table below its title line, such as "[skin]"; the title may be empty."""
    lines = [f"{key_text(key)} = {value_text(value)}" for key, value in values.items()]
    return "\n".join([*([title] if title else []), *lines, ""])


def key_text(name: str) -> str:
    """Return a name as a TOML key, in quotes if it has characters other than letters, digits, _ and -."""
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else value_text(name)


def value_text(value: Any) -> str:
    """Return a number, boolean, string, list or mapping as a TOML value on one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key_text(key)} = {value_text(one)}' for key, one in value.items())}}}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(value_text, value))}]"
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")  # JSON does not escape it
