"""A spec in its canonical form: all of it, in one order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dermis.apps.batch.distributions import Distribution
from dermis.scene.plain import Plain
from dermis.scene.toml_text import key_text, table_text

HEADER = "# A data set of dermis: lengths in mm, colours linear Rec. 709."


def tables_text(values: Mapping[str, Any]) -> str:
    """The TOML of values, distributions, tables and lists of tables, by name."""
    return "\n".join([HEADER, *_tables("", values)])


def plain_values(table: Plain) -> dict[str, Any]:
    """Fields by name, those left out that have no value."""
    return {
        name: getattr(table, name) for name in type(table).model_fields if getattr(table, name) is not None
    }


def _tables(title: str, values: Mapping[str, Any]) -> list[str]:
    own, below = dict[str, Any](), list[str]()
    for name, value in values.items():
        whole = f"{title}.{key_text(name)}" if title else key_text(name)
        if isinstance(value, Plain):
            below += _tables(whole, plain_values(value))
        elif isinstance(value, Mapping):
            below += _tables(whole, value)
        elif isinstance(value, tuple) and value and isinstance(value[0], Plain):
            below += [table_text(f"[[{whole}]]", plain_values(one)) for one in value]
        else:
            own[name] = value.told() if isinstance(value, Distribution) else value
    return [table_text(f"[{title}]" if title else "", own), *below] if own or not below else below
