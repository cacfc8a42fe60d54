"""Commands that measure exported skins and heads in other programs and write docs/engines.md."""

from __future__ import annotations

from dermis.base.command_line import run_script

PACKAGE = "dermis.apps.validation.engines"
COMMANDS = {
    "page": (
        f"{PACKAGE}.page:write_engines_page",
        "Write the tables of docs/engines.md between their markers.",
    ),
    "babylon": (
        f"{PACKAGE}.babylon:measure_babylon",
        "Measure a half-lit plane in Babylon.js; needs Chromium, DERMIS_BABYLON.",
    ),
    "blender": (
        f"{PACKAGE}.blender:measure_blender",
        "Measure half-lit planes and heads in Cycles; needs two Pythons with bpy.",
    ),
    "gltf": (
        f"{PACKAGE}.gltf:predict_gltf_errors",
        "Compute errors of skins in glTF's draft of volume scattering.",
    ),
    "heads": (
        f"{PACKAGE}.heads:compare_heads",
        "Render one head in all installed programs and compare it with ours.",
    ),
    "mitsuba": (
        f"{PACKAGE}.mitsuba:measure_mitsuba",
        "Measure a half-lit plane in Mitsuba.",
    ),
    "openpbr": (
        f"{PACKAGE}.openpbr:predict_openpbr_errors",
        "Compute errors of skins in OpenPBR, MaterialX's profile and pbrt.",
    ),
}

if __name__ == "__main__":
    run_script(COMMANDS, f"python -m {PACKAGE}")
