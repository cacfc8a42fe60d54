"""`dermis head`: a person of the parametric human, as a file that other programs open."""

from __future__ import annotations

import time
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

from cyclopts import Parameter

from dermis.base.console import print_report, working_on
from dermis.base.errors import refuse
from dermis.cli.head_options import parse_weights
from dermis.cli.options import Adapter, OutputPath, Flag, Json, Options, Integer, given

if TYPE_CHECKING:
    from dermis.human.hair.look import HairLook
    from dermis.human.person import Human
    from dermis.human.skin.look import SkinLook
    from dermis.mesh.eye_look import EyeLook
    from dermis.mesh.eyeball import EyePictures
    from dermis.mesh.head import Head

L = TypeVar("L", "SkinLook", "EyeLook", "HairLook")
TARGET, EXPRESSION = "--target", "--expression"
_Values = Parameter(negative="", metavar="NAME=VALUE,...", show_default=False)
_Pairs = Parameter(negative="", metavar="NAME=WEIGHT,...", show_default=False)


def head(
    *,
    output: OutputPath = Path("head.glb"),
    seed: Integer = None,
    african: float | None = None,
    asian: float | None = None,
    caucasian: float | None = None,
    sex: float | None = None,
    age: float | None = None,
    weight: float | None = None,
    muscle: float | None = None,
    target: Annotated[list[str] | None, _Pairs] = None,
    expression: Annotated[list[str] | None, _Pairs] = None,
    skin: Annotated[list[str] | None, _Pairs] = None,
    eye: Annotated[list[str] | None, _Pairs] = None,
    hair: Annotated[list[str] | None, _Values] = None,
    colour: Path | None = None,
    normal: Path | None = None,
    roughness: Path | None = None,
    size: int = 1024,
    layout: Literal["own", "hm08"] = "own",
    subdivide: Integer = None,
    adapter: Adapter = "auto",
    list_targets: Flag = False,
    as_json: Json = False,
) -> int:
    """Make a person of the parametric human and write it as glTF.

    Other programs find a mesh in metres with materials and maps, 52 morph targets by ARKit's names and a
    skeleton of neck, head, jaw and eyes; this package reads the same person back.

    Examples:

        dermis head -o head.glb

        dermis head --seed 7 --age 60 --target nose/nose-hump-incr=0.5 -o other.glb

        dermis head --asian 1 --african 0 --caucasian 0 --sex 1 --expression mouthSmileLeft=1,jawOpen=0.2

        dermis head --african 1 --asian 0 --caucasian 0 --skin melanin=0.3,moles=0.6 --size 4096 -o dark.glb

        dermis head --seed 7 --skin freckles=0.8 -o person.json && dermis render person.json

        dermis head --sex 1 --hair style=cropped,length_mm=5,beard_mm=4 -o man.json && dermis render man.json

        dermis render other.glb --pose jawOpen=0.6 --bone head=0,20,0 -o other.png

    Parameters
    ----------
    output:
        File to write: .glb, or .json for the person's numbers alone, which dermis render takes.
    seed:
        A person at random, the same for the same number [a person between all].
    african:
        Share of this ancestry, 0 to 1; only the ratios of the three count [1/3, or the seed's, as all below].
    asian:
        Share of this ancestry.
    caucasian:
        Share of this ancestry.
    sex:
        From 0, female, to 1, male [0].
    age:
        25 to 90 years [30].
    weight:
        From -1, least, to 1, most [0].
    muscle:
        From -1, least, to 1, most [0].
    target:
        Weights of published targets, as nose/nose-hump-incr=0.5; may be given again.
    expression:
        Weights with which morph targets of the file rest, as jawOpen=0.2; may be given again.
    skin:
        Pigments and texture: melanin, eumelanin, blood, oxygen, redness, freckles, moles, spots, tan, veins,
        stubble, recession, beard, oil and age, all from 0 to 1, and seed; as melanin=0.1,freckles=0.4 [what
        goes with the person].
    eye:
        eumelanin, 0 (blue) to 1 (dark brown), pupil_mm, redness, seed; as eumelanin=0.2 [what goes with it].
    hair:
        style (none, cropped or short), length_mm, density, curl, fade, beard_mm, bushy, grey, eumelanin,
        pheomelanin and seed; as style=cropped,length_mm=5 [what goes with the person]. In .glb hairs are
        thin tubes, which this package does not read back.
    colour:
        Picture of the skin's colour, sRGB [the head's own, as the next two].
    normal:
        Normal map, green up.
    roughness:
        Grey picture of the roughness.
    size:
        Side of the maps that are painted, a power of two from 256 to 4096 [texels].
    layout:
        own has most room for the face; hm08 is MakeHuman's, which its skins fit.
    subdivide:
        Levels of subdivision, 0 to 3; each takes four times the room [1].
    adapter:
        Which adapter paints: auto, cpu or part of a name.
    list_targets:
        Print the names of the published targets, and write nothing.
    """
    from dermis.base.atomic_write import check_output
    from dermis.frame.features.surface.painting.painted_head import painted_head
    from dermis.gpu.failures import run_on_device
    from dermis.human.person_file import numbers_of, write_numbers
    from dermis.human.published import human_targets

    if list_targets:
        print_report(as_json, list(human_targets()), human_targets)
        return 0
    started = time.perf_counter()
    check_output(output, (".glb", ".json"), "Choose .glb for a head, .json for the numbers of a person")
    ancestry = given(african=african, asian=asian, caucasian=caucasian)
    numbers = ancestry | given(sex=sex, age=age, weight=weight, muscle=muscle)
    resting = parse_weights(expression or [], EXPRESSION)
    person = _person(seed, numbers, parse_weights(target or [], TARGET))
    own = _look(person.look, skin, "--skin"), _look(person.iris, eye, "--eye")
    person = replace(person, skin=own[0], eyes=own[1], hair=_hair(person.hairdo, hair))
    report: Options = {"head": str(output), "person": numbers_of(person)}
    if output.suffix.lower() == ".json":
        report |= {"bytes": write_numbers(output, person)}
        print_report(as_json, report, lambda: [f"{output}  {report['bytes']} bytes"])
        return 0
    with working_on("making the head"):
        made = person.head(layout=layout, **given(subdivide=subdivide))
        made = _with_maps(made, given(colour=colour, normal=normal, roughness=roughness))
        made, eyes = run_on_device(adapter, lambda device: painted_head(device, made, size))
        length = _write(output, person, made, resting, eyes)
    seconds, triangles = round(time.perf_counter() - started, 3), len(made.mesh.triangles)
    report |= {
        "vertices": len(made.mesh.positions),
        "triangles": triangles,
        "bytes": length,
        "seconds": seconds,
    }
    said = f"{output}  {triangles:,} triangles  {length / 1e6:.1f} MB  {seconds:.1f} s"
    print_report(as_json, report, lambda: [said, *filter(None, [made.attribution])])
    return 0


def _person(seed: int | None, numbers: Options, targets: dict[str, float]) -> Human:
    """The drawn or the usual person, with what was given in place of its own."""
    from dermis.human.person import Human

    base = Human() if seed is None else Human.drawn(seed)
    return replace(base, **numbers, targets={**base.targets, **targets})


def _look(usual: L, words: list[str] | None, option: str) -> L:
    """A look with some of its numbers replaced."""
    chosen = parse_weights(words or [], option)
    known = [one.name for one in fields(usual)]
    for name in chosen:
        if name not in known:
            refuse(option, f"names of {', '.join(known)}", f"{name!r} came", "Correct it")
    numbers: Options = dict(chosen)
    if (seed := chosen.get("seed")) is not None and seed.is_integer():
        numbers["seed"] = int(seed)
    return replace(usual, **numbers)


def _hair(usual: HairLook, words: list[str] | None) -> HairLook:
    """Hair with some of it replaced; its style is a word."""
    pairs = [pair for pair in ",".join(words or []).split(",") if pair]
    styles = [pair.removeprefix("style=") for pair in pairs if pair.startswith("style=")]
    numbers = [pair for pair in pairs if not pair.startswith("style=")]
    style: Options = {"style": styles[-1]} if styles else {}
    return replace(_look(usual, numbers, "--hair"), **style)


def _with_maps(made: Head, files: Options) -> Head:
    """The head with maps of files in place of its own; a normal map takes the place of its relief."""
    from dermis.formats.maps import load_maps

    loaded = load_maps(**files)
    chosen = {role: getattr(loaded, role) for role in files} | ({"height": None} if "normal" in files else {})
    return replace(made, maps=replace(made.maps, **chosen))


def _write(
    output: Path, person: Human, made: Head, expression: dict[str, float], eyes: EyePictures | None
) -> int:
    from dermis.human.person_file import write_person
    from dermis.mesh.pose import Pose
    from dermis.scene.skin import Skin

    Pose(expression).motion(made.control, EXPRESSION)  # names and weights that can be
    return write_person(output, person, made, roughness=Skin().roughness, weights=expression, eyes=eyes)
