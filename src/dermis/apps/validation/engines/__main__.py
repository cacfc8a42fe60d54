"""Commands that measure exported skins and heads in other programs and write docs/engines.md."""

from __future__ import annotations

from dermis.base.command_line import run_script

PACKAGE = "dermis.apps.validation.engines"
COMMANDS = {
    f"{PACKAGE}.page:page": "Write the tables of docs/engines.md between their markers.",
    f"{PACKAGE}.babylon:babylon": "Measure a half-lit plane in Babylon.js; needs Chromium, DERMIS_BABYLON.",
    f"{PACKAGE}.blender:blender": "Measure half-lit planes and heads in Cycles; needs two Pythons with bpy.",
    f"{PACKAGE}.gltf:gltf": "Compute errors of skins in glTF's draft of volume scattering.",
    f"{PACKAGE}.heads:heads": "Render one head in all installed programs and compare it with ours.",
    f"{PACKAGE}.mitsuba:mitsuba": "Measure a half-lit plane in Mitsuba.",
    f"{PACKAGE}.openpbr:openpbr": "Compute errors of skins in OpenPBR, MaterialX's profile and pbrt.",
}

if __name__ == "__main__":
    run_script(COMMANDS, f"python -m {PACKAGE}")
