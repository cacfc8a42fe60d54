"""Deterministic formatting of plain Python objects as TOML.

The hash of this text identifies a data set, so the format must not depend on the version of a library.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any


def table_text(title: str, table_values: Mapping[str, Any]) -> str:
    """Return a mapping as a TOML table below its title line, such as "[skin]"; the title may be empty."""
    lines = [f"{key_text(key)} = {value_text(value)}" for key, value in table_values.items()]
    return "\n".join([*([title] if title else []), *lines, ""])


def key_text(key_name: str) -> str:
    """Return a name as a TOML key, in quotes if it has characters other than letters, digits, _ and -."""
    return key_name if re.fullmatch(r"[\w-]+", key_name, re.ASCII) else value_text(key_name)


def value_text(python_value: Any) -> str:
    """Return a number, boolean, string, list or mapping as a TOML value on one line."""
    if isinstance(python_value, bool):
        return str(python_value).lower()
    if isinstance(python_value, int | float):
        return repr(python_value)
    if isinstance(python_value, Mapping):
        return f"{{{', '.join(f'{key_text(key)} = {value_text(one)}' for key, one in python_value.items())}}}"
    if isinstance(python_value, Sequence) and not isinstance(python_value, str):
        return f"[{', '.join(map(value_text, python_value))}]"
    return json.dumps(str(python_value), ensure_ascii=False).replace(
        "\x7f", "\\u007f"
    )  # JSON does not escape it
