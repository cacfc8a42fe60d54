"""`dermis head`: a head made from a few numbers, as a file that other programs open."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from dermis.cli.console import print_json, print_lines, progress
from dermis.cli.options import Json, Whole, given


def head(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("head.glb"),
    seed: Whole = None,
    width: float | None = None,
    nose: float | None = None,
    ears: float | None = None,
    jaw: float | None = None,
    fullness: float | None = None,
    asymmetry: float | None = None,
    melanin: float | None = None,
    eumelanin: float | None = None,
    blood: float | None = None,
    oxygen: float | None = None,
    freckles: float | None = None,
    moles: float | None = None,
    oil: float | None = None,
    age: float | None = None,
    stubble: float | None = None,
    size: Whole = None,
    layout: Literal["few", "many"] = "few",
    as_json: Json = False,
) -> int:
    """Make a head with its maps and write it as glTF.

    Other programs find a mesh with colour, roughness and normal maps; this package also reads height, surface
    strength, roughness and face regions from it.

    Examples:

        dermis head -o head.glb

        dermis head --seed 7 --jaw 1.08 --nose 1.1 --melanin 0.06 --freckles 0.5 -o other.glb

        dermis render other.glb -o other.png

    Parameters
    ----------
    output:
        File to write: .glb.
    seed:
        Which small asymmetries, spots and folds [0].
    width:
        Breadth of the head over the average, 0.9 to 1.1.
    nose:
        Size of the nose, 0.8 to 1.25.
    ears:
        Size of the ears, 0.8 to 1.2.
    jaw:
        Breadth of the lower jaw, 0.88 to 1.12.
    fullness:
        Soft tissue, from -1 (lean, aged) to 1 (full, young).
    asymmetry:
        How much left and right differ, 0 to 2 times the usual.
    melanin:
        Share of melanosomes in the epidermis, 0 to 1.
    eumelanin:
        Share of them that is eumelanin.
    blood:
        Share of blood in the dermis.
    oxygen:
        Share of the haemoglobin that carries oxygen.
    freckles:
        Freckles, 0 to 1.
    moles:
        Moles, 0 to 1.
    oil:
        Oil on the skin, 0 to 1.
    age:
        Depth of the folds, 0 to 1.
    stubble:
        Shadow of the hair that was shaved off the head, 0 (bald) to 1.
    size:
        Side of the maps in texels, a power of two from 256 to 4096 [2048].
    layout:
        few charts, or many: a layout with as many seams as can be, to test them.
    """
    started = time.perf_counter()
    from dermis.human.bust.parameters import BustParameters
    from dermis.human.bust_file import BustRecipe, write_bust
    from dermis.human.skin_maps.look import SkinLook
    from dermis.outputs import check_output

    check_output(output, (".glb",), "Name it something.glb")
    chosen = given(seed=seed)
    proportions = given(width=width, nose=nose, ears=ears, jaw=jaw, fullness=fullness, asymmetry=asymmetry)
    pigments = given(melanin=melanin, eumelanin=eumelanin, blood=blood, oxygen=oxygen)
    marks = given(freckles=freckles, moles=moles, oil=oil, age=age, stubble=stubble)
    shape, look = BustParameters(**chosen, **proportions), SkinLook(**chosen, **pigments, **marks)
    recipe = BustRecipe(shape, look, layout=layout, **given(size=size))
    with progress("making the head") as report:
        write_bust(output, recipe, report)
    seconds = time.perf_counter() - started
    if as_json:
        print_json({"head": str(output), "size": recipe.size, "layout": layout, "seconds": round(seconds, 3)})
    else:
        print_lines(f"{output}  {seconds:.1f} s")
    return 0
