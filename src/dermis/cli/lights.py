"""`dermis lights`: the rigs of the package as files to start from."""

from __future__ import annotations

from dermis.base.console import print_json, print_lines
from dermis.cli.options import Json


def lights(name: str = "", /, *, as_json: Json = False) -> int:
    """Print a rig of lights as TOML, to change and pass to --lights; without a name, list the rigs.

    Examples:

        dermis lights

        dermis lights studio > mine.toml && dermis render --lights mine.toml

        dermis lights window --json

    Parameters
    ----------
    name:
        studio, window, top, rim, rembrandt, laser or another that the list has.
    as_json:
        Print one JSON object instead: under "lights" those of the rig, or under "rigs" what each is.
    """
    from dermis.base.errors import refuse
    from dermis.scene.lights import NO_LIGHTS, light_presets, preset_lights, preset_text

    rigs = {one: _summary(preset_text(one)) for one in light_presets() if one != NO_LIGHTS}
    if name and name not in rigs:
        refuse(name, f"a rig ({', '.join(rigs)})", "it is none of these", "Run dermis lights for the list")
    if as_json:
        made = [light.model_dump() for light in preset_lights(name)] if name else None
        print_json({"rigs": rigs} if made is None else {"rig": name, "lights": made})
    elif name:
        print_lines(preset_text(name).rstrip())
    else:
        width = max(map(len, rigs))
        print_lines(*(f"{one:<{width}}  {summary}" for one, summary in rigs.items()))
    return 0


def _summary(text: str) -> str:
    """The first sentence of a file's comment."""
    comment = " ".join(line.lstrip("# ") for line in text.split("\n\n")[0].splitlines())
    return comment.split(". ")[0].rstrip(".") + "."
