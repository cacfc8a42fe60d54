"""Changes to trees of tables, lists and values, written as JSON or TOML with text that no library writes."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator
from random import Random
from typing import Any

from adversity.hostile import DEPTHS, name, number, word

Tree = dict[str, Any]
Place = tuple[Any, Any]  # a table or list, and the key or index in it


class Written(str):
    """Text that is written to the file verbatim, without quotes."""


def places(tree: Any) -> Iterator[Place]:
    """Yield the paths of all values of a tree."""
    keys = list(tree) if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    for key in keys:
        yield tree, key
        yield from places(tree[key])


def changed_tree(tree: Tree, rng: Random) -> Tree:
    """Return the tree with one to three changes."""
    made = copy.deepcopy(tree)
    for _ in range(rng.choice((1, 1, 2, 3))):
        found = list(places(made))
        if found:
            rng.choice(_CHANGES)(*rng.choice(found), rng, found)
    return made


def _hostile(holder: Any, key: Any, rng: Random, _: list[Place]) -> None:
    """Return another value, half of the time of the same type."""
    old = holder[key]
    if isinstance(old, str) and rng.random() < 0.6:
        holder[key] = name(rng)
    elif rng.random() < 0.6 or isinstance(old, (int, float)):
        holder[key] = Written(number(rng))
    else:
        holder[key] = rng.choice((None, True, [], {}, "", word(rng), [Written(number(rng))] * 3, {"a": 1}))


def _remove(holder: Any, key: Any, rng: Random, _: list[Place]) -> None:
    del holder[key]


def _rename(holder: Any, key: Any, rng: Random, _: list[Place]) -> None:
    if isinstance(holder, dict):
        holder[word(rng)] = holder.pop(key)


def _nest(holder: Any, key: Any, rng: Random, _: list[Place]) -> None:
    depth = rng.choice(DEPTHS)
    if rng.random() < 0.7:
        holder[key] = Written("[" * depth + "]" * rng.choice((0, depth)))
    else:
        holder[key] = Written('{"a":' * depth)


def _repeat(holder: Any, key: Any, rng: Random, _: list[Place]) -> None:
    old = holder[key]
    holder[key] = (old if isinstance(old, list) else [old]) * rng.choice((2, 100, 3000))


def _exchange(holder: Any, key: Any, rng: Random, found: list[Place]) -> None:
    """Return a copy of another part of the tree."""
    other, there = rng.choice(found)
    holder[key] = copy.deepcopy(other[there])


_CHANGES: tuple[Callable[[Any, Any, Random, list[Place]], None], ...] = (
    *(_hostile, _hostile, _hostile, _hostile, _remove, _rename, _nest, _repeat, _exchange),
)


def json_text(value: Any) -> str:
    """Return the tree as JSON."""
    if isinstance(value, dict):
        return "{" + ",".join(f"{json.dumps(key)}:{json_text(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ",".join(map(json_text, value)) + "]"
    return str(value) if isinstance(value, Written) else json.dumps(value)


def toml_text(tree: Tree) -> str:
    """Return the tree as TOML: tables of the first level under headings, all others inline."""
    plain = {key: one for key, one in tree.items() if not isinstance(one, dict) and not _tables(one)}
    lines = [f"{_key(key)} = {_value(one)}" for key, one in plain.items()]
    for key, one in tree.items():
        if key not in plain:
            for table in [one] if isinstance(one, dict) else one:
                lines.append(f"[{_key(key)}]" if isinstance(one, dict) else f"[[{_key(key)}]]")
                lines += [f"{_key(inner)} = {_value(value)}" for inner, value in table.items()]
    return "\n".join([*lines, ""])


def _tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, dict) for one in value)


def _key(key: str) -> str:
    return key if key.isascii() and key.replace("_", "").replace("-", "").isalnum() else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_value(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return "null" if value is None else json_text(value)  # TOML has no null, which is hostile enough
