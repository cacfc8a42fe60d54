"""Command that renders one head by dermis, Cycles and Mitsuba on one CPU and reports times and errors.

It takes about twelve minutes on two idle cores, one or two with --quick. It needs the sample data, Mitsuba,
and for Cycles a Python with bpy, named by DERMIS_BLENDER_PYTHON. Times differ from run to run, images do not.
"""

from __future__ import annotations

from dermis.apps.validation.peers.report import peers
from dermis.base.command_line import run_script

if __name__ == "__main__":
    run_script(peers, "python -m dermis.apps.validation.peers")
