"""The command `dermis lights`: the lighting rigs of the package as TOML."""

from __future__ import annotations

from dermis.base.console import print_json, print_lines
from dermis.cli.options import JsonOption


def lights(name: str = "", /, *, as_json: JsonOption = False) -> int:
    """Print a lighting rig as TOML, to edit and pass to --lights; without a name, list all rigs.

    Examples:

        dermis lights

        dermis lights studio > mine.toml && dermis render --lights mine.toml

        dermis lights window --json

    Parameters
    ----------
    name:
        Name of a rig: studio, window, top, rim, rembrandt, laser or another rig of the list.
    as_json:
        Print one JSON object: the lights of the rig under "lights", or the summaries of all rigs under
        "rigs".
    """
    from dermis.base.errors import refuse
    from dermis.scene.lights import NO_LIGHTS, light_presets, preset_lights, preset_toml

    rigs = {rig: _first_sentence(preset_toml(rig)) for rig in light_presets() if rig != NO_LIGHTS}
    if name and name not in rigs:
        refuse(name, f"a rig ({', '.join(rigs)})", "it is none of these", "List them with dermis lights")
    if as_json:
        preset = [light.model_dump() for light in preset_lights(name)] if name else None
        print_json({"rigs": rigs} if preset is None else {"rig": name, "lights": preset})
    elif name:
        print_lines(preset_toml(name).rstrip())
    else:
        width = max(map(len, rigs))
        print_lines(*(f"{rig:<{width}}  {summary}" for rig, summary in rigs.items()))
    return 0


def _first_sentence(preset_toml: str) -> str:
    """Return the summary of a light preset: the first sentence of the comment at the top of its TOML.

    preset_toml : TOML of the preset
    """
    comment = " ".join(line.lstrip("# ") for line in preset_toml.split("\n\n")[0].splitlines())
    return comment.split(". ")[0].rstrip(".") + "."
