"""The command `dermis export`: files of a skin or head for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from dermis.apps.export.registry import TARGETS
from dermis.base.console import print_report, spinner
from dermis.base.errors import refuse
from dermis.base.quantities import checked_integer
from dermis.cli.head_options import HeadOptions, check_head_options
from dermis.cli.living_options import StatesOption, check_constant_states, parse_states
from dermis.cli.options import NO_OPTIONS, AdapterOption, FlagOption, JsonOption, OutputPath, drop_none

if TYPE_CHECKING:
    TargetName = str
else:
    TargetName = Annotated[str, Parameter(help=f"Program to write for: {', '.join(TARGETS)}.")]

_MAX_PICTURE_WIDTH = 2048
ProfileModelName = Literal["montecarlo", "layered", "multipole", "dipole", "better-dipole"]


def export(
    subject: str,
    /,
    *,
    to: TargetName,
    output: OutputPath,
    version: str | None = None,
    variant: str | None = None,
    diffuse_transmission: FlagOption = False,
    model: ProfileModelName | None = None,
    profile: str | None = None,
    library: Path | None = None,
    map_side: int = 2048,
    picture_width: int = 320,
    head: HeadOptions = NO_OPTIONS,
    state: StatesOption = None,
    adapter: AdapterOption = "auto",
    naive: FlagOption = False,
    as_json: JsonOption = False,
) -> int:
    """Export a skin or a head to another program, and report how well that program can reproduce it.

    The profile model of the program is fitted to the diffusion profile of the skin. The command reports three
    errors of the fit: of the fraction of light within a radius, of the brightness beside a shadow edge, and
    of the total light.

    Examples:

        dermis export skin1 --to unity -o skin1.asset

        dermis export dj3 --to unreal --naive -o dj3

        dermis export human:7 --to unity -o person

        dermis export human:7 --to gltf --diffuse-transmission -o person.glb

        dermis export human --to gltf --state blush=0.6 -o blush.glb

        dermis export human --to babylon -o head.html

        dermis export human --to web -o head.html

        dermis export head.glb --profile medium --to unity --version 14 -o head --json

    Parameters
    ----------
    subject:
        A skin (skin1, dj3, medium, gpu-gems-3 ..., a .toml or .csv file) or a head (human, human:SEED, a
        person (.json), a sample or a mesh file).
    output:
        File to write; a name without suffix is a folder, created if necessary. A README beside the file or in
        the folder lists the files, the steps of the import, the licence, and the parameters with their
        meaning and errors, and shows a picture. Parameters and errors are also written as JSON.
    version:
        Version of the program. [default: newest supported]
    variant:
        Variant of the export, such as a scattering method of the program. [default: the first variant]
    diffuse_transmission:
        Short for --variant diffuse-transmission of the target gltf.
    model:
        Model that computes the diffusion profile of the skin. [default: montecarlo for one semi-infinite
        layer, else layered]
    profile:
        Skin to use for a head. [default: the pigments of a person, else gpu-gems-3]
    library:
        For web pages: npm's node_modules folder with the library to embed. [default: the page loads the
        library from a public server]
    map_side:
        Side of the painted maps, a power of two from 256 to 4096 [texel].
    picture_width:
        Width and height of the picture of the head in the README [pixel]; 0 for no picture.
    naive:
        Also print the parameters that a user might choose without knowing their meaning in the program.
    as_json:
        Print one JSON object with the parameters and errors.
    """
    from dermis.apps.export.run import export_skin

    check_head_options(subject, head)
    if diffuse_transmission:
        if variant is not None:
            actual = f"it is given with --variant {variant}"
            refuse("--diffuse-transmission", "no other variant", actual, "Remove one of them")
        variant = "diffuse-transmission"
    weights = check_constant_states(parse_states(state or ())) or None
    checked_integer("--picture-width", picture_width, 0, _MAX_PICTURE_WIDTH)
    options = drop_none(
        picture_width=picture_width,
        state=weights,
        version=version,
        variant=variant,
        model=model,
        profile=profile,
        library=library,
    )
    with spinner(f"exporting {subject}"):
        report = export_skin(subject, to, output, side=map_side, adapter=adapter, **options, **head)
    print_report(as_json, report.as_json(), lambda: [*report.lines(naive), "", *map(str, report.files)])
    return 0
