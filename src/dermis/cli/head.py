"""The command `dermis head`: write people of the parametric human model to files for other programs."""

from __future__ import annotations

import time
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

from cyclopts import Parameter

from dermis.base.console import print_report, spinner
from dermis.base.errors import refuse
from dermis.cli.head_options import parse_weights
from dermis.cli.living_options import STATE_OPTION, StatesOption, check_constant_states, parse_states
from dermis.cli.options import (
    AdapterOption,
    FlagOption,
    IntegerOption,
    JsonOption,
    Options,
    OutputPath,
    drop_none,
)

if TYPE_CHECKING:
    from dermis.human.hair.look import HairLook
    from dermis.human.person import Human
    from dermis.human.skin.look import SkinLook
    from dermis.mesh.eye_look import EyeLook
    from dermis.mesh.eyeball import EyeTextures
    from dermis.mesh.head import Head

Look = TypeVar("Look", "SkinLook", "EyeLook", "HairLook")
TARGET_OPTION, EXPRESSION_OPTION = "--target", "--expression"
_ValuesParameter = Parameter(negative="", metavar="NAME=VALUE,...", show_default=False)
_WeightsParameter = Parameter(negative="", metavar="NAME=WEIGHT,...", show_default=False)


def head(
    *,
    output: OutputPath = Path("head.glb"),
    seed: IntegerOption = None,
    african: float | None = None,
    asian: float | None = None,
    caucasian: float | None = None,
    sex: float | None = None,
    age: float | None = None,
    weight: float | None = None,
    muscle: float | None = None,
    skin_ancestry: str | None = None,
    ita: float | None = None,
    target: Annotated[list[str] | None, _WeightsParameter] = None,
    expression: Annotated[list[str] | None, _WeightsParameter] = None,
    skin: Annotated[list[str] | None, _WeightsParameter] = None,
    eye: Annotated[list[str] | None, _WeightsParameter] = None,
    hair: Annotated[list[str] | None, _ValuesParameter] = None,
    clothing: str | None = None,
    glasses: str | None = None,
    headwear: str | None = None,
    colour: Path | None = None,
    normal: Path | None = None,
    roughness: Path | None = None,
    size: int = 1024,
    layout: Literal["own", "hm08"] = "own",
    subdivide: IntegerOption = None,
    state: StatesOption = None,
    adapter: AdapterOption = "auto",
    list_targets: FlagOption = False,
    as_json: JsonOption = False,
) -> int:
    """Create a person of the parametric human and write it as glTF.

    The file has a mesh in metres, materials and maps, 52 morph targets with the names of ARKit, and a
    skeleton of neck, head, jaw and eyes. Other programs and dermis itself can read it.

    Examples:

        dermis head -o head.glb

        dermis head --seed 7 --age 60 --target nose/nose-hump-incr=0.5 -o other.glb

        dermis head --asian 1 --african 0 --caucasian 0 --sex 1 --expression mouthSmileLeft=1,jawOpen=0.2

        dermis head --african 1 --asian 0 --caucasian 0 --skin melanin=0.3,moles=0.6 --size 4096 -o dark.glb

        dermis head --seed 7 --skin freckles=0.8 -o person.json && dermis render person.json

        dermis head --seed 7 --ita -30 -o person.json && dermis render person.json

        dermis head --sex 1 --hair style=cropped,length_mm=5,beard_mm=4 -o man.json && dermis render man.json

        dermis render other.glb --pose jawOpen=0.6 --bone head=0,20,0 -o other.png

    Parameters
    ----------
    output:
        File to write: .glb, or .json with only the parameters of the person, which `dermis render` reads.
    seed:
        Seed of a random person; other options override values of this person. [default: the average person]
    african:
        Proportion of this ancestry, 0 to 1; the three proportions are scaled to a sum of 1. [default: 1/3]
    asian:
        Proportion of this ancestry, 0 to 1. [default: 1/3]
    caucasian:
        Proportion of this ancestry, 0 to 1. [default: 1/3]
    sex:
        0 (female) to 1 (male). [default: 0]
    age:
        Age, 25 to 90 [years]. [default: 30]
    weight:
        Body weight, -1 (lowest) to 1 (highest). [default: 0]
    muscle:
        Muscle mass, -1 (lowest) to 1 (highest). [default: 0]
    skin_ancestry:
        Group of measured people that determines the colours of skin, eyes and hair, independently of the
        shape: african, arabian, asian, caucasian, chinese, iraqi, japanese, middle eastern, south asian or
        southeast asian. [default: the ancestry of the shape]
    ita:
        Individual typology angle of the cheek, -65 (darkest) to 70 (lightest) [degrees]; all pigments are
        typical of measured people with this angle. [default: from the person]
    target:
        Weights of MakeHuman shape targets, such as nose/nose-hump-incr=0.5; repeatable.
    expression:
        Weights of morph targets in the rest pose of the written file, such as jawOpen=0.2; repeatable.
    skin:
        Pigments and texture, such as melanin=0.1,freckles=0.4: melanin, eumelanin, blood, oxygen, redness,
        freckles, moles, spots, tan, veins, stubble, recession, beard, oil, age, blemishes, scars and vellus
        from 0 to 1, stubble_eumelanin and stubble_pheomelanin from 0 to 10, epidermis_mm, and seed. [default:
        from the person]
    eye:
        Eye appearance, such as eumelanin=0.2: eumelanin from 0 (blue) to 1 (dark brown), pupil_mm, redness,
        seed. [default: from the person]
    hair:
        Hair, such as style=bob,curl=0.3: style (none, short, long, afro, ponytail and others, see the guide),
        beard_style (none, stubble, short, full, moustache or goatee), length_mm, density, diameter_mm, curl,
        curl_radius_mm, curl_pitch_mm, curl_coherence, clump, clump_mm, frizz_mm, flyaways, parting_mm, fade,
        widows_peak, baby_hairs, beard_mm, bushy, grey, temple_grey, eumelanin, pheomelanin, dye_eumelanin,
        dye_pheomelanin, roots_mm and seed [default: from the person]. A .glb file contains simplified hair;
        when dermis reads the file, it grows the hair again, unless the mesh was changed.
    clothing:
        Garment in words for colour, cloth and cut, such as "navy denim shirt": crew neck, v-neck, high neck,
        shirt or hoodie; cotton, wool, denim or linen. [default: none]
    glasses:
        Glasses in words for colour and frame, such as "brown square": round, square, aviator, rimless or
        sunglasses. [default: none]
    headwear:
        Headwear in words for colour, cloth and style, such as "red beanie": cap, beanie, turban or headscarf;
        cotton, wool, denim or linen. [default: none]
    colour:
        Colour map of the skin, sRGB. [default: painted]
    normal:
        Normal map, green up. [default: painted]
    roughness:
        Grey roughness map. [default: painted]
    size:
        Side of the painted maps, a power of two from 256 to 4096 [texel].
    layout:
        uv layout: own (most texels for the face), or hm08 (MakeHuman's layout, for MakeHuman's skin
        textures).
    subdivide:
        Levels of subdivision, 0 to 3; each level makes the file four times larger. [default: 1]
    list_targets:
        Print the names of the MakeHuman shape targets and exit.
    as_json:
        Print one JSON object with the parameters of the person and the size of the file.
    """
    from dermis.base.atomic_write import check_output
    from dermis.frame.features.surface.painting.painted_head import paint_head
    from dermis.gpu.failures import run_on_device
    from dermis.human.makehuman import human_targets
    from dermis.human.person_file import person_parameters, write_person_json
    from dermis.scene.living import SkinState

    if list_targets:
        print_report(as_json, list(human_targets()), human_targets)
        return 0
    started = time.perf_counter()
    check_output(output, (".glb", ".json"), "Choose .glb for a head, .json for the parameters of a person")
    ancestry = drop_none(african=african, asian=asian, caucasian=caucasian)
    numbers = ancestry | drop_none(sex=sex, age=age, weight=weight, muscle=muscle)
    rest_weights = parse_weights(expression or [], EXPRESSION_OPTION)
    tone = drop_none(skin_ancestry=skin_ancestry, ita=ita)
    person = _build_person(seed, numbers, tone, parse_weights(target or [], TARGET_OPTION))
    person = replace(
        person,
        skin=_look_with_values(person.look, skin, "--skin"),
        eyes=_look_with_values(person.iris, eye, "--eye"),
        hair=_hair_look_with_values(person.hair_look, hair),
        **drop_none(clothing=clothing, glasses=glasses, headwear=headwear),
    )
    weights = check_constant_states(parse_states(state or ()))
    skin_state = SkinState(weights) if weights else None
    if skin_state and (output.suffix.lower() == ".json" or colour is not None):
        actual = "a file of parameters has none" if colour is None else "--colour replaces the painted map"
        refuse(STATE_OPTION, "a .glb file with painted maps", actual, "Leave it out")
    report: Options = {"head": str(output), "person": person_parameters(person)}
    if output.suffix.lower() == ".json":
        report |= {"bytes": write_person_json(output, person)}
        print_report(as_json, report, lambda: [f"{output}  {report['bytes']} bytes"])
        return 0
    with spinner("creating the head"):
        person_head = person.head(layout=layout, **drop_none(subdivide=subdivide))
        person_head = _head_with_maps(
            person_head, drop_none(colour=colour, normal=normal, roughness=roughness)
        )
        person_head, eyes = run_on_device(
            adapter, lambda device: paint_head(device, person_head, size, skin_state)
        )
        byte_count = _write_glb(output, person, person_head, rest_weights, eyes)
    seconds, mesh = round(time.perf_counter() - started, 3), person_head.mesh
    report |= {"vertices": len(mesh.positions), "triangles": len(mesh.triangles)}
    report |= {"bytes": byte_count, "seconds": seconds}
    summary = f"{output}  {len(mesh.triangles):,} triangles  {byte_count / 1e6:.1f} MB  {seconds:.1f} s"
    print_report(as_json, report, lambda: [summary, *filter(None, [person_head.attribution])])
    return 0


def _build_person(
    seed: int | None, field_values: Options, skin_tone: Options, target_weights: dict[str, float]
) -> Human:
    """Return the average person, or the random person of a seed, with some parameters and targets replaced.

    field_values : dictionary from fields of `Human` to their new values
    skin_tone : skin ancestry and ITA (individual typology angle), which determine the person's skin
    target_weights : dictionary from MakeHuman shape targets to weights
    """
    from dermis.human.person import Human

    base = Human(**skin_tone) if seed is None else Human.sampled(seed, **skin_tone)
    return replace(base, **field_values, targets={**base.targets, **target_weights})


def _look_with_values(look: Look, option_values: list[str] | None, option_name: str) -> Look:
    """Return a copy of a skin, eye or hair look with the field values that an option gives.

    option_values : values "NAME=NUMBER,..." of the option
    option_name : option, such as --skin, for error messages
    """
    from dermis.human.skin.look import SITES_FIELD

    values = parse_weights(option_values or [], option_name)
    field_names = [field.name for field in fields(look) if field.name != SITES_FIELD]
    for name in values:
        if name not in field_names:
            refuse(option_name, f"a name of {', '.join(field_names)}", f"got {name!r}", "Correct it")
    numbers: Options = dict(values)
    if (seed := values.get("seed")) is not None and seed.is_integer():
        numbers["seed"] = int(seed)
    return replace(look, **numbers)


_STRING_FIELD_PREFIXES = "style=", "beard_style="


def _hair_look_with_values(look: HairLook, option_values: list[str] | None) -> HairLook:
    """Return a copy of a hair look with the field values that the option --hair gives.

    option_values : values "NAME=VALUE,..." of the option; VALUE is a word for the fields `style` and
        `beard_style`, and a number for all other fields
    """
    pairs = [pair for pair in ",".join(option_values or []).split(",") if pair]
    words: Options = dict(pair.split("=", 1) for pair in pairs if pair.startswith(_STRING_FIELD_PREFIXES))
    numbers = [pair for pair in pairs if not pair.startswith(_STRING_FIELD_PREFIXES)]
    if "beard_style" in words and not any(pair.startswith("beard_mm=") for pair in pairs):
        words["beard_mm"] = None  # the usual length of the style
    return replace(_look_with_values(look, numbers, "--hair"), **words)


def _head_with_maps(head: Head, map_files: Options) -> Head:
    """Return a copy of the head with maps loaded from files; a loaded normal map replaces the height map."""
    from dermis.formats.maps import load_maps

    loaded = load_maps(**map_files)
    maps = {role: getattr(loaded, role) for role in map_files} | (
        {"height": None} if "normal" in map_files else {}
    )
    return replace(head, maps=replace(head.maps, **maps))


def _write_glb(
    output: Path, person: Human, head: Head, expression: dict[str, float], eyes: EyeTextures | None
) -> int:
    from dermis.human.person_file import write_person_glb
    from dermis.mesh.pose import Pose
    from dermis.scene.skin import Skin

    Pose(expression).to_arrays(
        head.control_rig, EXPRESSION_OPTION
    )  # raises for unknown names and invalid weights
    return write_person_glb(
        output, person, head, roughness=Skin().roughness, expression_weights=expression, eyes=eyes
    )
