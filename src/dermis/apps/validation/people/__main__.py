"""Commands that compare people sampled at random with a spectral archive of measured people.

The commands need the archive in the folder DERMIS_DATA, see docs/measured.md.
"""

from __future__ import annotations

from dermis.base.command_line import run_script

PACKAGE = "dermis.apps.validation.people"
COMMANDS = {
    "table": (
        f"{PACKAGE}.table:write_measured_table",
        "Write the table of measured people in the package.",
    ),
    "people": (
        f"{PACKAGE}.drawn:print_random_people_tables",
        "Print a comparison of drawn people with the archive.",
    ),
    "page": (
        f"{PACKAGE}.drawn:write_random_people_tables",
        "Measure the variation of people and write docs/measured.md.",
    ),
}
"""Function and description of each command, by its name."""

if __name__ == "__main__":
    run_script(COMMANDS, f"python -m {PACKAGE}")
