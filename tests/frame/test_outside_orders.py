"""Registered entries are known in any order of imports: nothing copies a registry."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
FRAME = ("dermis.frame.renderer", "dermis.scene.outputs", "dermis.frame.programs")
EXPORT = ("dermis.apps.export.run", "dermis.apps.export.targets.pbrt.target")
REFERENCE = ("dermis.apps.truths.lights", "dermis.apps.truths.cycles")
CLI = (
    "dermis.cli",
    "dermis.cli.cite",
    "dermis.cli.render",
    "dermis.cli.export",
    "dermis.cli.compare",
)


@pytest.mark.parametrize(
    "before",
    [(), (*CLI, *REFERENCE, *EXPORT, *FRAME)],
    ids=["nothing", "all"],
)
def test_plugins_register_in_any_order(before: tuple[str, ...]) -> None:
    """Entries are rendered, exported to pbrt with a note, refused by a truth and cited by a command."""
    path = os.pathsep.join([str(HERE), str(HERE.parent), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, str(HERE / "outside" / "registered.py"), *before]
    run = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stderr
    assert "@" in run.stdout and "Borshukov2003" in run.stdout and "Phong1975" in run.stdout
