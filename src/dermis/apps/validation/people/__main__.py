"""Commands that compare random people with measured spectra, and check their hair and worn items.

The comparisons need the archive in the folder DERMIS_DATA, see docs/measured.md.
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
    "hair": (
        f"{PACKAGE}.hair_penetration:print_hair_penetration",
        "Print how much hair is inside the skin of people, by hair style; needs no archive.",
    ),
    "wear": (
        f"{PACKAGE}.wear_penetration:print_wear_penetration",
        "Count points of worn items inside skin, and hair inside clothing; needs no archive.",
    ),
}
"""Function and description of each command, by its name."""

if __name__ == "__main__":
    run_script(COMMANDS, f"python -m {PACKAGE}")
