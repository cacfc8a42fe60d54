"""Render the same head by dermis, Cycles and Mitsuba on one CPU: seconds, noise and error against the truth.

About twelve minutes on two idle cores; --quick takes one or two. Needs the sample data, Mitsuba, and for
Cycles DERMIS_BLENDER_PYTHON, a Python that has bpy. Times differ from run to run, images do not.
"""

from __future__ import annotations

from dermis.apps.validation.peers.report import peers
from dermis.base.command_line import run_script

if __name__ == "__main__":
    run_script(peers, "python -m dermis.apps.validation.peers")
