"""Commands that measure errors of the package's approximations and write the pages about them.

Most commands need the sample data (DERMIS_DATA, or a network).
"""

from __future__ import annotations

from dermis.base.command_line import run_script

PACKAGE = "dermis.apps.validation.accuracy"
COMMANDS = {
    "page": (
        f"{PACKAGE}.page:write_accuracy_page",
        "Write docs/accuracy.md from what the commands below measure.",
    ),
    "techniques": (
        f"{PACKAGE}.techniques:write_techniques_page",
        "Write docs/techniques.md; needs Mitsuba and the folder tests.",
    ),
    "motion": (
        f"{PACKAGE}.motion:write_motion_page",
        "Write docs/motion.md; needs MakeHuman's heads and the folder tests.",
    ),
    "person": (
        f"{PACKAGE}.person:compare_people_with_path_tracer",
        "Compare people with path tracing for docs/path_traced.md; needs Mitsuba.",
    ),
    "person-page": (
        f"{PACKAGE}.person:write_path_traced_page",
        "Write docs/path_traced.md from the last measurement.",
    ),
    "hair-page": (
        f"{PACKAGE}.hair:write_hair_page",
        "Compare hair with path tracing and write docs/hair.md; needs Mitsuba.",
    ),
    "highlights": (
        f"{PACKAGE}.cycles_comparison:compare_highlights",
        "Measure highlights for docs/accuracy.md; needs bpy.",
    ),
    "looks": (
        f"{PACKAGE}.cycles_comparison:compare_skins",
        "Render skins for docs/accuracy.md; needs bpy.",
    ),
    "blur": (
        f"{PACKAGE}.blur:print_blur_errors",
        "Print the tables of the blur on the atlas; needs the folder tests.",
    ),
    "light": (
        f"{PACKAGE}.light:print_light_errors",
        "Print the tables of environments, furnaces, area lights and occlusion.",
    ),
    "optics": (
        f"{PACKAGE}.optics:print_optics_errors",
        "Print the tables of diffusion models, fits and light through thin parts.",
    ),
    "specular": (
        f"{PACKAGE}.specular:print_specular_errors",
        "Print the tables of the surface's albedo and of the furnace.",
    ),
    "slabs": (
        f"{PACKAGE}.slabs:print_slab_errors",
        "Print the tables of light through slabs.",
    ),
    "thin": (
        f"{PACKAGE}.thin:print_thin_body_errors",
        "Print the tables of light through slabs, wedges and ears.",
    ),
    "half-space": (
        f"{PACKAGE}.half_space:print_half_space_table",
        "Print the table of reflection by direction.",
    ),
    "measured": (
        f"{PACKAGE}.measured.measure:fit_measured_spectra",
        "Fit measured spectra of people, and write docs/measured.md.",
    ),
    "priors": (
        f"{PACKAGE}.measured.priors:fit_priors",
        "Fit the pigments of measured people, and write their table.",
    ),
    "measured-page": (
        f"{PACKAGE}.measured.measure:rewrite_measured_page",
        "Write docs/measured.md from the last measurement.",
    ),
}
"""Function and description of each command, by its name."""

if __name__ == "__main__":
    run_script(COMMANDS, f"python -m {PACKAGE}")
