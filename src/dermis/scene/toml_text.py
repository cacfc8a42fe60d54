"""Plain values as TOML.

Data sets are known by the hash of this text, so that its form must not change with a library's.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any


def table_text(title: str, values: Mapping[str, Any]) -> str:
    """A table's lines under its title, none where that is empty."""
    lines = [f"{key_text(key)} = {value_text(value)}" for key, value in values.items()]
    return "\n".join([*([title] if title else []), *lines, ""])


def key_text(name: str) -> str:
    """A name as a key, quoted where it has other letters than keys may have."""
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else value_text(name)


def value_text(value: Any) -> str:
    """A number, a truth value, a text, or lists and mappings of such, on one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key_text(key)} = {value_text(one)}' for key, one in value.items())}}}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(value_text, value))}]"
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")  # which JSON leaves as it is
