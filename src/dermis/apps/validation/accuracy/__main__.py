"""Commands that measure errors of the package's approximations and write the pages about them.

Most commands need the sample data (DERMIS_DATA, or a network).
"""

from __future__ import annotations

from dermis.base.command_line import run_script

PACKAGE = "dermis.apps.validation.accuracy"
COMMANDS = {
    f"{PACKAGE}.page:page": "Write docs/accuracy.md from what the commands below measure.",
    f"{PACKAGE}.techniques:techniques": "Write docs/techniques.md; needs Mitsuba and the folder tests.",
    f"{PACKAGE}.motion:motion": "Write docs/motion.md; needs MakeHuman's heads and the folder tests.",
    f"{PACKAGE}.person:person": "Compare people with path tracing for docs/path_traced.md; needs Mitsuba.",
    f"{PACKAGE}.person:person_page": "Write docs/path_traced.md from the last measurement.",
    f"{PACKAGE}.cycles_comparison:highlights": "Measure highlights for docs/accuracy.md; needs bpy.",
    f"{PACKAGE}.cycles_comparison:looks": "Render skins for docs/accuracy.md; needs bpy.",
    f"{PACKAGE}.blur:blur": "Print the tables of the blur on the atlas; needs the folder tests.",
    f"{PACKAGE}.light:light": "Print the tables of environments, furnaces, area lights and occlusion.",
    f"{PACKAGE}.optics:optics": "Print the tables of diffusion models, fits and light through thin parts.",
    f"{PACKAGE}.specular:specular": "Print the tables of the surface's albedo and of the furnace.",
    f"{PACKAGE}.slabs:slabs": "Print the tables of light through slabs.",
    f"{PACKAGE}.thin:thin": "Print the tables of light through slabs, wedges and ears.",
    f"{PACKAGE}.half_space:half_space": "Print the table of reflection by direction.",
    f"{PACKAGE}.measured.measure:measured": "Fit measured spectra of people, and write docs/measured.md.",
    f"{PACKAGE}.measured.priors:priors": "Fit the pigments of measured people, and write their table.",
    f"{PACKAGE}.measured.measure:measured_page": "Write docs/measured.md from the last measurement.",
}
"""Functions that run as commands, with their descriptions."""

if __name__ == "__main__":
    run_script(COMMANDS, f"python -m {PACKAGE}")
