"""Words of users inside files of other programs: quoted so that they stay words."""

from __future__ import annotations

import json


def yaml_text(words: str) -> str:
    """A YAML scalar in double quotes, which JSON's are; no other program reads it as anything else."""
    return json.dumps(words)


def python_text(words: str) -> str:
    """A string of Python in ASCII."""
    return json.dumps(words)
