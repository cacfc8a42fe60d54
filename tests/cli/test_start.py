"""Commands that show no picture start without the libraries of pictures."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import dermis

SLOW_TO_IMPORT = {"scipy", "wgpu", "numpy", "pydantic", "PIL"}
SCRIPT = """
import json, sys
from dermis.cli import main
try:
    main()
finally:
    print(json.dumps(sorted(name for name in sys.modules if "." not in name)), file=sys.stderr)
"""


def imported_by(*arguments: str) -> set[str]:
    """Return the top-level modules that the command line imports."""
    environment = {**os.environ, "PYTHONPATH": str(Path(dermis.__file__).parents[1])}
    command = [sys.executable, "-c", SCRIPT, *arguments]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert ended.stdout
    return set(json.loads(ended.stderr.splitlines()[-1]))


@pytest.mark.parametrize("argument", ["--help", "--version"])
def test_program_without_a_command(argument: str) -> None:
    assert imported_by(argument) & SLOW_TO_IMPORT == set()


def test_help_of_a_command() -> None:
    assert imported_by("render", "--help") & {"scipy", "wgpu"} == set()
