"""Command that renders one head with dermis, Cycles and Mitsuba on one CPU and reports times and errors.

The command takes about twelve minutes on two idle cores, or one to two minutes with --quick. It needs the
sample data and Mitsuba. Cycles needs a Python program that has the module bpy; the environment variable
DERMIS_BLENDER_PYTHON names this program. Times differ from run to run, images do not.
"""

from __future__ import annotations

from dermis.apps.validation.peers.report import write_peer_report
from dermis.base.command_line import run_script

if __name__ == "__main__":
    run_script(write_peer_report, "python -m dermis.apps.validation.peers")
