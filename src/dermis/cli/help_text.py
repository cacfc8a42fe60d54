"""Help as docstrings have it, for terminals of any width."""

from __future__ import annotations

from inspect import cleandoc


def reflowed(docstring: str | None) -> str:
    """The text with each paragraph on a line of its own, as a terminal wraps it."""
    made: list[str] = []
    for line in cleandoc(docstring or "").splitlines():
        if made and _goes_on(made[-1], line):
            made[-1] += f" {line.strip()}"
        else:
            made.append(line)
    return "\n".join(made)


def _goes_on(before: str, line: str) -> bool:
    """Whether a line belongs to the paragraph before it: blank lines, indents and underlines part them."""
    if not before.strip() or not line.strip() or {*before.strip()} == {"-"} or {*line.strip()} == {"-"}:
        return False
    return _indent(before) == _indent(line)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())
