"""Each property of USD and STL files is treated as its reader declares."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from egg import BUMPY, CLOTH, SKIN
from property_rows import loaded, names_of, row_named, treatment
from stl_file import BALL as STL_BALL
from stl_file import write_stl
from usd_file import BALL, TEXTURE, material, mesh, stage, text_of

from dermis.base.file_properties import FileProperty
from dermis.formats.stl import STL_PROPERTIES
from dermis.formats.usd import read
from dermis.formats.usd.read import USD_PROPERTIES
from dermis.formats.usd.shading import USD_MATERIAL_PROPERTIES
from dermis.images.io import write_png

NORMALS = np.tile([0.0, 0.0, 1.0], (len(BALL.positions), 1))
BELOW = 'double3 xformOp:translate = (0, -0.2, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
COLOURS = np.linspace(0.2, 0.8, 3 * len(BALL.positions)).reshape(-1, 3)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with pictures and layers; files are decoded in this process."""
    pytest.importorskip("pxr")
    from dermis.formats.usd.decoder import decode

    (tmp_path / "copies").mkdir()
    monkeypatch.chdir(tmp_path / "copies")
    monkeypatch.setattr(read, "run_decoder", lambda module, request, *others: decode(request))
    for name, picture in {"skin": SKIN, "cloth": CLOTH, "bumps": BUMPY}.items():
        write_png(tmp_path / f"{name}.png", picture)
    (tmp_path / "other.usda").write_text(stage(mesh("Collar", more=BELOW)))
    return tmp_path


class Change(NamedTuple):
    """Texts before and after a change that exercises the row of which the name begins so."""

    row: str
    before: str
    after: str


def metadata(text: str) -> str:
    return stage(metadata=text)


def with_mesh(bound: str = "face", **options: str) -> str:
    return stage(mesh(bound=bound, **options), material())


def sampled(text: str) -> str:
    points = f"point3f[] points = {text_of(BALL.positions)}"
    first, second = (text_of(factor * BALL.positions) for factor in (1.1, 1.2))
    return text.replace(points, f"point3f[] points.timeSamples = {{ 5: {first}, 6: {second} }}")


def bound_to(name: str) -> str:
    rough = "float inputs:roughness = 1"  # which is not noted
    return stage(mesh(bound=name), material("face", rough), material("skin", rough, file="cloth.png"))


def two_materials(uv: str) -> str:
    """Return a mesh of two materials, the second with uv of a name."""
    uv_texts = [
        f'texCoord2f[] primvars:{name} = {text_of(factor * BALL.uv)} ( interpolation = "vertex" )'
        for name, factor in (("st", 1.0), ("other", 0.5))
    ]
    subset = f"""
    def GeomSubset "lower" ( prepend apiSchemas = ["MaterialBindingAPI"] ) {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = {text_of(np.arange(100, len(BALL.triangles)))}
        rel material:binding = </model/skin>
    }}"""
    own = mesh(primvars="\n".join(uv_texts[::-1] if uv == "other" else uv_texts), more=subset)
    return stage(own, material("face", uv="other" if uv == "other" else "st"), material("skin", uv="st"))


SMOOTH = f'normal3f[] normals = {text_of(NORMALS)} ( interpolation = "vertex" )'
PAINTED = f'color3f[] primvars:displayColor = {text_of(COLOURS)} ( interpolation = "vertex" )'
SHIFTED = f'texCoord2f[] primvars:st = {text_of(0.5 * BALL.uv)} ( interpolation = "vertex" )'
CHANGES = [
    Change("`metersPerUnit`", stage(), metadata("metersPerUnit = 1.1")),
    Change("a file without `metersPerUnit`", stage(), metadata("")),
    Change("`upAxis`", stage(), metadata('metersPerUnit = 1\nupAxis = "Z"')),
    Change(
        "meshes, with transforms",
        stage(),
        with_mesh(more=BELOW.replace("-0.2", "0.1").replace("(0,", "(0.1,")),
    ),
    Change("meshes, with transforms", stage(), with_mesh(more="int[] holeIndices = [0, 7]")),
    Change(
        "meshes that are invisible",
        stage(),
        stage(mesh(), mesh("B", more='token visibility = "invisible"'), material()),
    ),
    Change("time samples", stage(), sampled(stage())),
    Change(
        "`subdivisionScheme`",
        with_mesh(more=SMOOTH),
        with_mesh(more=SMOOTH).replace('"none"', '"catmullClark"'),
    ),
    Change("primvars of each", stage(), with_mesh(primvars=SHIFTED)),
    Change("primvars of each", stage(), with_mesh(more=SMOOTH)),
    Change("several sets of uv", two_materials("st"), two_materials("other")),
    Change("`displayColor`", with_mesh(""), with_mesh("", more=PAINTED)),
    Change("materials of meshes", bound_to("face"), bound_to("skin")),
    Change("pictures", stage(), stage(mesh(), material(file="cloth.png"))),
    Change("sublayers", stage(), metadata("metersPerUnit = 1\nsubLayers = [@./other.usda@]")),
    Change("layers in other places", stage(), metadata("metersPerUnit = 1\nsubLayers = [@/etc/other.usda@]")),
    Change("cameras", stage(), stage(mesh(), material(), 'def Camera "camera" {}')),
]


@pytest.mark.parametrize("change", CHANGES, ids=[one.row for one in CHANGES])
def test_each_property_of_a_usd_file_is_treated_as_declared(change: Change, folder: Path) -> None:
    assert_treatment(folder, change, row_named(USD_PROPERTIES, change.row).treatment)


def assert_treatment(folder: Path, change: Change, expected: str) -> None:
    results = []
    for text in (change.before, change.after):
        (folder / "a.usda").write_text(text)
        results.append(loaded(folder / "a.usda"))
    assert treatment(*results) == expected, results[1].notes + results[1].error


def heads(which: str, changed: str) -> str:
    """Return a face and a shirt, one of which has a changed material."""
    own = {"face": material(), "shirt": material("shirt", file="cloth.png")} | {which: changed}
    return stage(mesh(), mesh("Collar", bound="shirt", more=BELOW), *own.values())


def material_changes(which: str) -> list[Change]:
    file = {"face": "skin.png", "shirt": "cloth.png"}[which]
    path = f"</model/{which}/"

    def own(inputs: str = "", more: str = "", extra: str = "") -> str:
        text = material(which, inputs, more, file=file)
        return heads(which, text.rstrip().removesuffix("}") + extra + "\n}")

    def connected(kind: str, name: str, output: str, source: str = "picture") -> str:
        return f"{kind} inputs:{name}.connect = {path}{source}.outputs:{output}>"

    def plain(text: str, colour: str) -> str:
        return text.replace(
            connected("color3f", "diffuseColor", "rgb"), f"color3f inputs:diffuseColor = {colour}"
        )

    place = f"""
    def Shader "place" {{
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = {path}reader.outputs:result>
        float inputs:rotation = 30
        float2 outputs:result
    }}"""
    reader = f"st.connect = {path}reader"
    turned_uv = own(extra=place).replace(reader, reader.replace("reader", "place"))
    bumps = TEXTURE.format(name="bumps", file="bumps.png", material=which, more="")
    gone = TEXTURE.format(name="bumps", file="gone.png", material=which, more="")
    normal = connected("normal3f", "normal", "rgb", "bumps")
    unused = ("float inputs:clearcoat = 1", "float inputs:ior = 1.4", "float inputs:displacement = 0.1")
    unused += ("color3f inputs:specularColor = (1, 0, 0)", connected("float", "occlusion", "r"))
    wraps = "\n".join(f'token inputs:wrap{axis} = "clamp"' for axis in "ST")
    bare = own().replace(f"token outputs:surface.connect = {path}surface.outputs:surface>", "")
    start = own().index(f'def Material "{which}"')
    foreign = own()[:start] + own()[start:].replace("UsdPreviewSurface", "ND_standard", 1)
    glow = connected("color3f", "emissiveColor", "rgb")
    return [
        Change("`diffuseColor`", plain(own(), "(0.5, 0.4, 0.3)"), plain(own(), "(0.2, 0.3, 0.4)")),
        Change("`diffuseColor`", own(), own(normal, extra=bumps)),
        Change("picture of the `roughness`", own(), own(connected("float", "roughness", "g"))),
        Change("value of the `roughness`", own(), own("float inputs:roughness = 0.3")),
        Change("`metallic`", own(), own("float inputs:metallic = 0.5")),
        Change("`metallic`", own(), own("color3f inputs:emissiveColor = (0.5, 0, 0)")),
        Change("`opacity`", own(), own("float inputs:opacity = 0.4")),
        Change("`opacity`", own(), own(connected("float", "opacity", "a"))),
        Change("another picture", own(), own(connected("float", "opacity", "r"))),
        Change("`scale`", own(), own(more="float4 inputs:scale = (0.5, 0.5, 0.5, 1)")),
        Change("`scale`", own(), turned_uv),
        Change("`bias`", own(), own(more="float4 inputs:bias = (0.1, 0.1, 0.1, 0)")),
        Change("`bias`", own(more=wraps), own(more=wraps.replace("clamp", "black", 1))),
        Change("`bias`", own(), own(more='token inputs:sourceColorSpace = "raw"')),
        *(Change("`clearcoat`", own(), own(inputs)) for inputs in unused),
        Change("emission without", plain(own(), "(0, 0, 0)"), plain(own(glow), "(0, 0, 0)")),
        Change("shaders other than", bare, foreign),
        Change("a picture that is missing", own(), own(normal, extra=gone)),
    ]


MATERIAL_CHANGES = [(which, change) for which in ("face", "shirt") for change in material_changes(which)]


@pytest.mark.parametrize(
    ("which", "change"), MATERIAL_CHANGES, ids=[f"{which} {change.row}" for which, change in MATERIAL_CHANGES]
)
def test_each_property_of_a_usd_material_is_treated_as_declared(
    which: str, change: Change, folder: Path
) -> None:
    row = row_named(USD_MATERIAL_PROPERTIES, change.row)
    assert_treatment(folder, change, row.treatment if which == "face" else row.other_parts or row.treatment)


def test_all_table_rows_are_exercised() -> None:
    assert {row_named(USD_PROPERTIES, one.row).name for one in CHANGES} == names_of(USD_PROPERTIES)
    assert {row_named(USD_MATERIAL_PROPERTIES, one.row).name for _, one in MATERIAL_CHANGES} == names_of(
        USD_MATERIAL_PROPERTIES
    )


def turned(data: bytes) -> bytes:
    """Return a binary STL file with other normals."""
    start, size = 84, 50
    pieces = [data[k : k + size] for k in range(start, len(data), size)]
    return data[:start] + b"".join(np.float32([0, 0, 1]).tobytes() + one[12:] for one in pieces)


CORNER, LARGER = (np.float32(factor * STL_BALL.positions[40]).tobytes() for factor in (1.0, 1.1))
STL_CHANGES: dict[str, Callable[[Path], object]] = {
    "corners of triangles": lambda path: path.write_bytes(path.read_bytes().replace(CORNER, LARGER)),
    "normals of triangles": lambda path: path.write_bytes(turned(path.read_bytes())),
    "attribute bytes": lambda path: write_stl(path, attribute=5),
    "name or header": lambda path: write_stl(path, header=b"a program"),
}


@pytest.mark.parametrize("row", STL_PROPERTIES, ids=lambda row: row.name)
def test_each_stl_property_is_treated_as_declared(row: FileProperty, tmp_path: Path) -> None:
    path = write_stl(tmp_path / "a.stl")
    before = loaded(path)
    STL_CHANGES[row.name](path)
    assert treatment(before, loaded(path)) == row.treatment
