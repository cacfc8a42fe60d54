"""`dermis export`: a skin or a head for another program, with how wrong it will be there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from dermis.apps.export.registry import TARGETS
from dermis.base.console import print_report, working_on
from dermis.base.errors import refuse
from dermis.cli.head_options import HeadOptions, check_head
from dermis.cli.options import NO_OPTIONS, Adapter, OutputPath, Flag, Json, given

if TYPE_CHECKING:
    TargetName = str
else:
    TargetName = Annotated[str, Parameter(help=f"Program to write for: {', '.join(TARGETS)}.")]

Model = Literal["montecarlo", "layered", "multipole", "dipole", "better-dipole"]


def export(
    what: str,
    /,
    *,
    to: TargetName,
    output: OutputPath,
    version: str | None = None,
    variant: str | None = None,
    diffuse_transmission: Flag = False,
    model: Model | None = None,
    profile: str | None = None,
    library: Path | None = None,
    map_side: int = 2048,
    head: HeadOptions = NO_OPTIONS,
    adapter: Adapter = "auto",
    naive: Flag = False,
    as_json: Json = False,
) -> int:
    """Write a skin or a head for another program, and say how wrong it will be there.

    The true profile is fitted with what the program can show, by the program's own formulas, and the
    differences are stated: of light within a radius, beside a shadow's edge, and in all.

    Examples:

        dermis export skin1 --to unity -o skin1.asset

        dermis export dj3 --to unreal --naive -o dj3

        dermis export human:7 --to unity -o person

        dermis export human:7 --to gltf --diffuse-transmission -o person.glb

        dermis export human --to babylon -o head.html

        dermis export human --to web -o head.html

        dermis export head.glb --profile medium --to unity --version 14 -o head --json

    Parameters
    ----------
    what:
        A skin (skin1, dj3, medium, gpu-gems-3 ..., a .toml or .csv file), or a head: human, human:7, a
        person's .json, a sample, or a file.
    output:
        File to write, or a folder that is made where the name has no suffix. A table of parameters, meanings
        and errors is written beside it, as a page and as JSON.
    version:
        Of the program [the newest that is known].
    variant:
        Of what the program can do, such as a method of scattering [its first].
    diffuse_transmission:
        The same as --variant diffuse-transmission, which gltf has.
    model:
        What the true profile is by [montecarlo for one layer without end, layered for others].
    profile:
        Skin of a head [a person's own pigments, or gpu-gems-3].
    library:
        For pages: the folder node_modules that npm has installed the library into, which is then put into the
        page; else it is loaded from a public server.
    map_side:
        Of maps that are painted, a power of two from 256 to 4096 [texels].
    adapter:
        Which adapter paints maps: auto, cpu or part of a name.
    naive:
        Also print what one would type without knowing what the numbers mean there.
    """
    from dermis.apps.export.run import export_skin

    check_head(what, head)
    if diffuse_transmission:
        if variant is not None:
            came = f"--variant {variant} came with it"
            refuse("--diffuse-transmission", "no other variant", came, "Leave one of them out")
        variant = "diffuse-transmission"
    told = given(version=version, variant=variant, model=model, profile=profile, library=library)
    with working_on(f"exporting {what}"):
        report = export_skin(what, to, output, side=map_side, adapter=adapter, **told, **head)
    print_report(as_json, report.as_json(), lambda: [*report.lines(naive), "", *map(str, report.files)])
    return 0
