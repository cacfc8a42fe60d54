"""USD scenes: geometry, materials, units and axes, and layers that are not opened."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from usd_file import BALL, PICTURE, TEXTURE, material, mesh, stage, text_of, write_package, write_usd

from dermis.base.errors import DermisError
from dermis.formats.load import load_rigged
from dermis.formats.materials import FileMaterial
from dermis.formats.parts import MeshFile
from dermis.formats.usd import read
from dermis.formats.usd.read import read_usd
from dermis.images.io import EmbeddedPicture
from dermis.scene.heads import load_head

pytest.importorskip("pxr")
SUFFIXES = ("usda", "usdc", "usdz")
CORNERS = BALL.triangles.ravel()


@pytest.fixture
def _in_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Decode in this process, as the start of another takes half a second."""
    from dermis.formats.usd.decoder import decode

    (tmp_path / "copies").mkdir()
    monkeypatch.chdir(tmp_path / "copies")
    monkeypatch.setattr(read, "run_decoder", lambda module, request, *others: decode(request))


in_process = pytest.mark.usefixtures("_in_process")


def read_text(folder: Path, text: str | None = None, name: str = "a.usda") -> MeshFile:
    return read_usd(write_usd(folder / name, text))


def material_of(folder: Path, text: str) -> FileMaterial:
    (one,) = read_text(folder, stage(mesh(), text)).materials
    return one


def test_package_is_decoded_in_another_process(tmp_path: Path) -> None:
    (part,) = read_text(tmp_path, name="a.usdz").parts
    assert len(part.triangles) == len(BALL.triangles)


@in_process
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_head_captured_by_a_phone_is_loaded(suffix: str, tmp_path: Path) -> None:
    text = stage(metadata='metersPerUnit = 1\nupAxis = "Y"')
    with pytest.warns(match="roughness 0.5"):
        head = load_head(write_usd(tmp_path / f"a.{suffix}", text), subdivide=0)
    np.testing.assert_allclose(
        np.sort(head.mesh.positions, axis=0), np.sort(1000 * BALL.positions, axis=0), atol=1e-3
    )
    assert head.maps.colour is not None and len(head.mesh.triangles) == len(BALL.triangles)
    assert [one.kind for one in head.mesh.materials] == ["skin"]


@in_process
def test_uv_and_triangles_equal_those_of_the_file(tmp_path: Path) -> None:
    rigged = load_rigged(write_usd(tmp_path / "a.usda"))
    given = np.column_stack((1000 * BALL.positions, BALL.uv))
    found = np.column_stack((rigged.mesh.positions, rigged.mesh.uv))
    order = [np.lexsort(np.round(rows, 3).T) for rows in (given, found)]
    np.testing.assert_allclose(found[order[1]], given[order[0]], atol=1e-3)
    assert (np.einsum("fi,fi->f", *facing(rigged.mesh)) > 0).all()


def facing(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    corners = mesh.positions[mesh.triangles].astype(float)
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners.mean(axis=1)


@in_process
@pytest.mark.parametrize(
    ("metadata", "options"),
    [
        ('metersPerUnit = 0.01\nupAxis = "Z"', {}),
        ('upAxis = "Z"', {}),
        ('metersPerUnit = 1\nupAxis = "Y"', {"unit_mm": 10.0, "up": "z"}),
    ],
)
def test_unit_and_axis_are_those_of_the_file_unless_given(
    metadata: str, options: dict[str, Any], tmp_path: Path
) -> None:
    text = stage(mesh(scale=100), material(), metadata=metadata)
    rigged = load_rigged(write_usd(tmp_path / "a.usda", text), **options)
    turned = 1000 * BALL.positions[:, [0, 2, 1]] * [1, 1, -1]
    np.testing.assert_allclose(np.sort(rigged.mesh.positions, axis=0), np.sort(turned, axis=0), atol=1e-2)
    assert any("its unit is not stated" in note for note in rigged.notes) == ("metersPerUnit" not in metadata)


@in_process
@pytest.mark.filterwarnings("ignore::dermis.base.errors.DermisWarning")
@pytest.mark.parametrize("suffix", ["usda", "usdc"])
def test_an_up_axis_that_the_user_states_replaces_that_of_the_file(suffix: str, tmp_path: Path) -> None:
    text = stage(mesh(scale=100), material(), metadata='metersPerUnit = 0.01\nupAxis = "Z"')
    path = write_usd(tmp_path / f"a.{suffix}", text)
    for positions in (
        load_rigged(path, up="y").mesh.positions,
        load_head(path, up="y", subdivide=0).mesh.positions,
    ):
        np.testing.assert_allclose(positions.max(axis=0), 1000 * BALL.positions.max(axis=0), rtol=1e-2)
    found = load_rigged(path, up="y", front="x").mesh.positions
    turned = 1000 * BALL.positions[:, [2, 1, 0]] * [-1, 1, 1]
    np.testing.assert_allclose(np.sort(found, axis=0), np.sort(turned, axis=0), atol=1e-2)


@in_process
def test_a_front_along_the_axis_of_the_file_is_refused(tmp_path: Path) -> None:
    path = write_usd(tmp_path / "a.usda", stage(metadata='upAxis = "Z"'))
    with pytest.raises(
        DermisError, match="a front across the up axis of the file, but front is -z, and up is z"
    ):
        load_rigged(path, front="-z")


UV = BALL.uv.astype(np.float32)
INDEXED = np.unique(UV, axis=0, return_inverse=True)
INTERPOLATIONS = {
    "vertex": f'texCoord2f[] primvars:st = {text_of(UV)} ( interpolation = "vertex" )',
    "face-varying": f'texCoord2f[] primvars:st = {text_of(UV[CORNERS])} ( interpolation = "faceVarying" )',
    "indexed": f'texCoord2f[] primvars:st = {text_of(INDEXED[0])} ( interpolation = "faceVarying" )\n'
    f"int[] primvars:st:indices = {text_of(INDEXED[1].ravel()[CORNERS])}",
    "floats of another name": f'float2[] primvars:UVMap = {text_of(UV)} ( interpolation = "varying" )',
}


@in_process
@pytest.mark.parametrize("name", INTERPOLATIONS)
def test_uv_of_each_interpolation_are_read(name: str, tmp_path: Path) -> None:
    (part,) = read_text(tmp_path, stage(mesh(primvars=INTERPOLATIONS[name]), material())).parts
    assert part.uv is not None
    np.testing.assert_allclose(part.uv[part.triangles].reshape(-1, 2), UV[CORNERS], atol=1e-6)


@in_process
@pytest.mark.parametrize("name", ["normals", "primvars:normals"])
@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
def test_normals_are_read_unless_the_mesh_is_subdivided(scheme: str, name: str, tmp_path: Path) -> None:
    normals = f'normal3f[] {name} = {text_of(BALL.normals[CORNERS])} ( interpolation = "faceVarying" )'
    text = mesh(more=normals).replace('"none"', f'"{scheme}"')
    (part,) = read_text(tmp_path, stage(text, material())).parts
    assert (part.normals is not None) == (scheme == "none")
    if part.normals is not None:
        np.testing.assert_allclose(
            part.normals[part.triangles].reshape(-1, 3), BALL.normals[CORNERS], atol=1e-6
        )


MIRROR = 'double3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
LEFT = 'uniform token orientation = "leftHanded"'


@in_process
@pytest.mark.parametrize("more", [MIRROR, LEFT, f"{MIRROR}\n{LEFT}"])
def test_mirrored_and_left_handed_meshes_face_as_they_state(more: str, tmp_path: Path) -> None:
    (part,) = read_text(tmp_path, stage(mesh(more=more), material())).parts
    corners = part.positions[part.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = np.einsum("fi,fi->f", normal, corners.mean(axis=1)) > 0
    assert outward.all() if more == MIRROR else not outward.any()


@in_process
def test_subsets_of_faces_have_their_own_materials(tmp_path: Path) -> None:
    faces = np.arange(len(BALL.triangles))
    subset = f"""
    def GeomSubset "lower" ( prepend apiSchemas = ["MaterialBindingAPI"] ) {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = {text_of(faces[100:])}
        rel material:binding = </model/shirt>
    }}"""
    text = stage(mesh(more=subset), material("face"), material("shirt"))
    mesh_file = read_text(tmp_path, text)
    assert [len(part.triangles) for part in mesh_file.parts] == [100, len(faces) - 100]
    assert [part.group.names for part in mesh_file.parts] == [("face", "Head"), ("shirt", "Head")]
    assert [mesh_file.materials[part.group.material].name for part in mesh_file.parts] == ["face", "shirt"]


@in_process
def test_holes_are_left_out(tmp_path: Path) -> None:
    (part,) = read_text(tmp_path, stage(mesh(more="int[] holeIndices = [0, 7]"), material())).parts
    assert len(part.triangles) == len(BALL.triangles) - 2


COLOURS = np.random.default_rng(3).uniform(0.2, 0.9, (len(BALL.positions), 3)).round(3)


@in_process
@pytest.mark.parametrize("interpolation", ["vertex", "faceVarying"])
def test_colours_of_vertices_are_linear_and_need_no_material(interpolation: str, tmp_path: Path) -> None:
    values = COLOURS if interpolation == "vertex" else COLOURS[CORNERS]
    colours = f'color3f[] primvars:displayColor = {text_of(values)} ( interpolation = "{interpolation}" )'
    (part,) = read_text(tmp_path, stage(mesh(more=colours, bound=""))).parts
    assert part.colours is not None
    np.testing.assert_allclose(part.colours[part.triangles].reshape(-1, 3), COLOURS[CORNERS], atol=1e-6)


@in_process
def test_a_colour_of_the_whole_mesh_is_that_of_its_group(tmp_path: Path) -> None:
    (part,) = read_text(
        tmp_path, stage(mesh(more="color3f[] primvars:displayColor = [(0.5, 0.25, 0.125)]", bound=""))
    ).parts
    assert part.group.colour == (0.5, 0.25, 0.125) and part.colours is None


@in_process
def test_a_material_can_read_the_colours_of_vertices(tmp_path: Path) -> None:
    reader = """
    def Material "face" {
        token outputs:surface.connect = </model/face/surface.outputs:surface>
        def Shader "surface" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </model/face/colours.outputs:result>
            token outputs:surface
        }
        def Shader "colours" {
            uniform token info:id = "UsdPrimvarReader_float3"
            string inputs:varname = "paint"
            float3 outputs:result
        }
    }"""
    colours = f'color3f[] primvars:paint = {text_of(COLOURS)} ( interpolation = "vertex" )'
    (part,) = read_text(tmp_path, stage(mesh(more=colours), reader)).parts
    assert part.colours is not None and part.group.colour == (1, 1, 1)


@in_process
def test_values_of_a_material_are_read(tmp_path: Path) -> None:
    inputs = """float inputs:roughness = 0.3
        float inputs:metallic = 0.25
        color3f inputs:emissiveColor = (0.5, 0, 0)
        float inputs:opacity = 0.5
        float inputs:opacityThreshold = 0.75"""
    more = """token inputs:wrapS = "mirror"
        token inputs:wrapT = "repeat"
        float4 inputs:scale = (0.5, 0.25, 1, 1)"""
    found = material_of(tmp_path, material(inputs=inputs, more=more))
    assert (found.name, found.roughness, found.stated_metalness) == ("face", pytest.approx(0.3), 0.25)
    assert (found.emission, found.alpha, found.alpha_mode, found.alpha_cutoff) == (
        (0.5, 0, 0),
        0.5,
        "mask",
        0.75,
    )
    assert found.colour == (0.5, 0.25, 1) and found.unused == ()
    texture = found.textures["colour"]
    assert texture.wrap == ("mirror", "repeat") and texture.picture == tmp_path / "skin.png"


@in_process
def test_pictures_of_roughness_normals_and_opacity_are_read(tmp_path: Path) -> None:
    inputs = "\n".join(
        f"{kind} inputs:{name}.connect = </model/face/{source}.outputs:{output}>"
        for kind, name, source, output in (
            ("float", "roughness", "rough", "g"),
            ("normal3f", "normal", "bumps", "rgb"),
            ("float", "opacity", "picture", "a"),
        )
    )
    centred = "float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)"
    extra = TEXTURE.format(name="rough", file="skin.png", material="face", more="")
    extra += TEXTURE.format(name="bumps", file="skin.png", material="face", more=centred)
    text = material(inputs=inputs).rstrip().removesuffix("}") + extra + "\n}"
    found = material_of(tmp_path, text)
    assert set(found.textures) == {"colour", "roughness", "normal"} and found.unused == ()
    assert (found.textures["roughness"].channel, found.roughness, found.normal_scale) == (1, 1.0, 1.0)
    assert (found.alpha_mode, found.alpha) == ("blend", 1.0)


@in_process
def test_texture_transform_matches_the_specification(tmp_path: Path) -> None:
    reader = """float2 inputs:st.connect = </model/face/place.outputs:result>"""
    place = """
    def Shader "place" {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </model/face/reader.outputs:result>
        float inputs:rotation = 30
        float2 inputs:scale = (2, 0.5)
        float2 inputs:translation = (0.1, 0.2)
        float2 outputs:result
    }"""
    text = material().replace("float2 inputs:st.connect = </model/face/reader.outputs:result>", reader)
    texture = material_of(tmp_path, text.rstrip().removesuffix("}") + place + "\n}").textures["colour"]
    uv, angle = np.array([[0.3, 0.6], [0.9, 0.2]]), np.radians(30)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    expected = uv * [2, 0.5] @ turn + [0.1, 0.2]
    down = texture.map_uv(np.column_stack((uv[:, 0], 1 - uv[:, 1])))
    np.testing.assert_allclose(np.column_stack((down[:, 0], 1 - down[:, 1])), expected, atol=1e-9)


UNUSED = {
    "float inputs:clearcoat = 1": "clear coat",
    "float inputs:ior = 1.4": "index of refraction",
    "float inputs:displacement = 0.1": "displacement",
    "color3f inputs:specularColor = (1, 0, 0)": "specular colour",
    "float inputs:occlusion.connect = </model/face/picture.outputs:r>": "picture of occlusion",
    "float inputs:opacity.connect = </model/face/picture.outputs:r>": "picture of the opacity",
}


@in_process
@pytest.mark.parametrize("inputs", UNUSED)
def test_inputs_without_effect_are_noted(inputs: str, tmp_path: Path) -> None:
    assert any(UNUSED[inputs] in one for one in material_of(tmp_path, material(inputs=inputs)).unused)


@in_process
def test_an_unlit_scan_has_the_colours_of_its_emission(tmp_path: Path) -> None:
    inputs = "color3f inputs:emissiveColor.connect = </model/face/picture.outputs:rgb>"
    text = material(inputs=inputs).replace(
        "color3f inputs:diffuseColor.connect = </model/face/picture.outputs:rgb>",
        "color3f inputs:diffuseColor = (0, 0, 0)",
    )
    found = material_of(tmp_path, text)
    assert set(found.textures) == {"colour"} and found.emission == (0, 0, 0)
    assert any("unlit" in one for one in found.unused)


@in_process
def test_other_surface_types_are_noted(tmp_path: Path) -> None:
    found = material_of(tmp_path, material().replace('"UsdPreviewSurface"', '"ND_standard_surface"'))
    assert found.unused == ("surface ND_standard_surface",)


@in_process
@pytest.mark.parametrize("file", ["lost.png", "../other.png", "/etc/hostname", "https://a.example/other.png"])
@pytest.mark.parametrize("suffix", ["usda", "usdz"])
def test_missing_pictures_are_noted(suffix: str, file: str, tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "other.png").write_bytes(PICTURE)
    (found,) = read_text(tmp_path, stage(mesh(), material(file=file)), f"in/a.{suffix}").materials
    assert found.textures == {} and "picture" in found.missing["colour"]


@in_process
def test_absolute_picture_path_is_looked_up_in_the_folder(tmp_path: Path) -> None:
    texture = material_of(tmp_path, material(file="/elsewhere/skin.png")).textures["colour"]
    assert texture.picture == tmp_path / "skin.png"


@in_process
def test_pictures_of_a_package_are_read_from_it(tmp_path: Path) -> None:
    (found,) = read_text(tmp_path, name="a.usdz").materials
    picture = found.textures["colour"].picture
    assert isinstance(picture, EmbeddedPicture) and picture.data == PICTURE


@in_process
def test_hidden_meshes_are_not_drawn_and_other_prims_are_noted(tmp_path: Path) -> None:
    hidden = (
        mesh("Hidden", more='token visibility = "invisible"'),
        mesh("Guide", more='uniform token purpose = "guide"'),
    )
    others = (
        'def Camera "camera" {}',
        'def DistantLight "sun" {}',
        'def Sphere "ball" {}',
        'def Sphere "other" {}',
    )
    mesh_file = read_text(tmp_path, stage(mesh(), *hidden, *others, material()))
    assert [part.group.names[1] for part in mesh_file.parts] == ["Head"]
    assert "these prims are left out: Sphere (2), Camera (1), DistantLight (1)" in mesh_file.notes


@in_process
def test_the_first_frame_of_a_recording_is_read(tmp_path: Path) -> None:
    points = f"point3f[] points = {text_of(BALL.positions)}"
    samples = (
        f"point3f[] points.timeSamples = {{ 5: {text_of(BALL.positions)}, 6: {text_of(2 * BALL.positions)} }}"
    )
    (part,) = read_text(tmp_path, stage(mesh().replace(points, samples), material())).parts
    assert np.abs(part.positions).max() == pytest.approx(0.12)


LAYER = "#usda 1.0\n( subLayers = [@{}@] )\n"
REFERENCE = '#usda 1.0\n(\nmetersPerUnit = 1\n)\ndef Xform "model" ( references = @{}@</model> ) {{}}\n'


@in_process
@pytest.mark.parametrize("text", [LAYER, REFERENCE, REFERENCE.replace("references", "payload")])
def test_layers_in_the_folder_are_read(text: str, tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    write_usd(tmp_path / "parts" / "head.usda")
    (part,) = read_text(tmp_path, text.format("./parts/head.usda")).parts
    assert len(part.triangles) == len(BALL.triangles)
    inner = {"parts/head.usda": stage().encode(), "parts/skin.png": PICTURE}
    root = text.format("./parts/head.usda").encode()
    packed = read_usd(write_package(tmp_path / "a.usdz", {"root.usda": root, **inner}))
    assert set(packed.materials[0].textures) == {"colour"}


OUTSIDE = {
    "beside the folder": "../head.usda",
    "absolute": "/etc/head.usda",
    "of a network": "https://a.example/head.usda",
    "missing": "./lost.usda",
    "not a layer": "./skin.png",
    "in a package": "./b.usdz[scene.usda]",
    "a package": "./b.usdz",
    "a link": "./link.usda",
}


@in_process
@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.parametrize("text", [LAYER, REFERENCE])
def test_layers_outside_the_folder_are_refused(text: str, name: str, tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    write_usd(tmp_path / "head.usda")
    write_usd(folder / "b.usdz")
    (folder / "link.usda").symlink_to(tmp_path / "head.usda")
    with pytest.raises(
        DermisError, match=r"a\.usda: expected layers in its own folder or below, but it references"
    ):
        read_text(folder, text.format(OUTSIDE[name]))


@in_process
def test_nested_layers_are_checked(tmp_path: Path) -> None:
    (tmp_path / "inner.usda").write_text(LAYER.format("/etc/head.usda"))
    variants = """#usda 1.0
def "model" (
    variantSets = "a"
    variants = {
        string a = "y"
    }
)
{
    variantSet "a" = {
        "x" (
            references = @./inner.usda@
        ) {
        }
        "y" {
        }
    }
}"""
    with pytest.raises(DermisError, match=r"references '/etc/head\.usda'"):
        read_text(tmp_path, variants)


@in_process
def test_value_clips_are_refused(tmp_path: Path) -> None:
    clips = (
        'def Xform "clips" ( clips = { dictionary default = { asset[] assetPaths = [@/etc/a.usda@] } } ) {}'
    )
    with pytest.raises(DermisError, match="a scene without value clips, but /model/clips has some"):
        read_text(tmp_path, stage(mesh(), clips))


@in_process
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("int[] faceVertexIndices = [", "int[] faceVertexIndices = [9999", "valid faces"),
        ("int[] faceVertexCounts = [3", "int[] faceVertexCounts = [4", "valid faces"),
        ("int[] faceVertexCounts = [3", "int[] faceVertexCounts = [-3", "valid faces"),
        ('"vertex"', '"faceVarying"', "a value for each vertex or corner"),
        ("metersPerUnit = 1", "metersPerUnit = 0", "metersPerUnit above 0"),
        (
            "token outputs:surface\n",
            "token outputs:surface\nfloat inputs:roughness = nan\n",
            "finite numbers in materials",
        ),
    ],
)
def test_invalid_values_are_refused(old: str, new: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(DermisError, match=rf"a\.usda: expected {message}"):
        read_text(tmp_path, stage().replace(old, new, 1))


def test_text_error_is_refused_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(
        DermisError, match=r"a\.usda: expected a USD scene, but it cannot be opened \(a\.usda:7:"
    ):
        read_text(tmp_path, stage().replace("def Mesh", "deaf Mesh"))


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.usdc"
    path.write_bytes(write_usd(tmp_path / "b.usdc").read_bytes()[:900])
    with pytest.raises(DermisError, match=r"a\.usdc: expected a (valid )?USD (file|scene), but"):
        read_usd(path)


@in_process
def test_a_package_must_begin_with_a_layer(tmp_path: Path) -> None:
    path = write_package(tmp_path / "a.usdz", {"skin.png": PICTURE, "scene.usda": stage().encode()})
    with pytest.raises(DermisError, match="a package whose first file is a USD layer"):
        read_usd(path)


def test_without_the_package_the_refusal_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "pxr").mkdir()
    (tmp_path / "pxr" / "__init__.py").write_text("raise ImportError('none')")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    with pytest.raises(
        DermisError, match=r"a\.usda: USD scenes: expected the package usd-core.*dermis\[engines\]"
    ):
        read_usd(write_usd(tmp_path / "a.usda"))
