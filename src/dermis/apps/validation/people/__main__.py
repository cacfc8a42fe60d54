"""Commands that compare people sampled at random with a spectral archive of measured people.

The commands need the archive in the folder DERMIS_DATA, see docs/measured.md.
"""

from __future__ import annotations

from dermis.base.command_line import run_script

PACKAGE = "dermis.apps.validation.people"
COMMANDS = {
    f"{PACKAGE}.table:table": "Write the table of measured people in the package.",
    f"{PACKAGE}.drawn:people": "Print a comparison of drawn people with the archive.",
    f"{PACKAGE}.drawn:page": "Measure the variation of people and write docs/measured.md.",
}
"""Functions that run as commands, with their descriptions."""

if __name__ == "__main__":
    run_script(COMMANDS, f"python -m {PACKAGE}")
