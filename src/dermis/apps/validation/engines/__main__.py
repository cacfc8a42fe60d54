"""Commands that measure exported skins and heads in other programs and write docs/engines.md."""

from __future__ import annotations

from dermis.base.command_line import run_script

HERE = "dermis.apps.validation.engines"
COMMANDS = {
    f"{HERE}.page:page": "Write the tables of docs/engines.md between their markers.",
    f"{HERE}.babylon:babylon": "Measure a half-lit plane in Babylon.js; needs Chromium and DERMIS_BABYLON.",
    f"{HERE}.blender:blender": "Measure half-lit planes and heads in Cycles; needs two Pythons with bpy.",
    f"{HERE}.gltf:gltf": "Compute errors of skins in glTF's draft of volume scattering.",
    f"{HERE}.heads:heads": "Render one head in all installed programs and compare it with ours.",
    f"{HERE}.mitsuba:mitsuba": "Measure a half-lit plane in Mitsuba.",
    f"{HERE}.openpbr:openpbr": "Compute errors of skins in OpenPBR, MaterialX's profile and pbrt.",
}

if __name__ == "__main__":
    run_script(COMMANDS, f"python -m {HERE}")
