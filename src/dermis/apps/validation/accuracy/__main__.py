"""Commands that measure errors of the package's approximations and write the pages about them.

Most commands need the sample data (DERMIS_DATA, or a network).
"""

from __future__ import annotations

from dermis.base.command_line import run_script

HERE = "dermis.apps.validation.accuracy"
COMMANDS = {
    f"{HERE}.page:page": "Write docs/accuracy.md from what the commands below measure.",
    f"{HERE}.techniques:techniques": "Write docs/techniques.md; needs Mitsuba and the folder tests.",
    f"{HERE}.motion:motion": "Write docs/motion.md; needs MakeHuman's published heads and the folder tests.",
    f"{HERE}.person:person": "Compare people with path tracing for docs/path_traced.md; needs Mitsuba.",
    f"{HERE}.person:person_page": "Write docs/path_traced.md from the last measurement.",
    f"{HERE}.cycles_comparison:highlights": "Measure highlights for docs/accuracy.md; needs bpy.",
    f"{HERE}.cycles_comparison:looks": "Render skins for docs/accuracy.md; needs bpy.",
    f"{HERE}.blur:blur": "Print the tables of the blur on the atlas; needs the folder tests.",
    f"{HERE}.light:light": "Print the tables of environments, furnaces, area lights and occlusion.",
    f"{HERE}.optics:optics": "Print the tables of diffusion models, fits and light through thin parts.",
    f"{HERE}.specular:specular": "Print the tables of the surface's albedo and of the furnace.",
    f"{HERE}.slabs:slabs": "Print the tables of light through slabs.",
    f"{HERE}.thin:thin": "Print the tables of light through slabs, wedges and ears.",
    f"{HERE}.half_space:half_space": "Print the table of reflection by direction.",
    f"{HERE}.measured.measure:measured": "Fit measured spectra of people, and write docs/measured.md.",
    f"{HERE}.measured.priors:priors": "Fit the pigments of measured people, and write their table.",
    f"{HERE}.measured.measure:measured_page": "Write docs/measured.md from the last measurement.",
}
"""Functions that run as commands, with their descriptions."""

if __name__ == "__main__":
    run_script(COMMANDS, f"python -m {HERE}")
