"""USD files of a small head, as text: a ball of 240 mm with a material, and what tests add."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from dermis.images.codecs import encode_png
from dermis.mesh.primitives import uv_sphere

BALL = uv_sphere(0.12, 12, 8)
PICTURE = encode_png(np.full((16, 16, 3), (200, 150, 120), np.uint8))
READER = """
def Shader "reader" {{
    uniform token info:id = "UsdPrimvarReader_float2"
    string inputs:varname = "{uv}"
    float2 outputs:result
}}
"""
TEXTURE = """
def Shader "{name}" {{
    uniform token info:id = "UsdUVTexture"
    asset inputs:file = @{file}@
    float2 inputs:st.connect = </model/{material}/reader.outputs:result>
    {more}
    float3 outputs:rgb
    float outputs:r
    float outputs:g
    float outputs:a
}}
"""


def text_of(values: np.ndarray) -> str:
    """Return numbers or rows of numbers as a list of USD."""
    rows = np.asarray(values)
    if rows.ndim == 1:
        return f"[{', '.join(f'{one:.9g}' for one in rows)}]"
    return f"[{', '.join('(' + ', '.join(f'{one:.9g}' for one in row) + ')' for row in rows)}]"


def material(
    name: str = "face", inputs: str = "", more: str = "", uv: str = "st", file: str = "skin.png"
) -> str:
    """Return a material with a picture of its colour.

    inputs : further inputs of its surface
    more : further inputs of its picture
    """
    textures = TEXTURE.format(name="picture", file=file, material=name, more=more)
    return f"""
def Material "{name}" {{
    token outputs:surface.connect = </model/{name}/surface.outputs:surface>
    def Shader "surface" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </model/{name}/picture.outputs:rgb>
        {inputs}
        token outputs:surface
    }}
    {textures}
    {READER.format(uv=uv)}
}}
"""


def mesh(
    name: str = "Head", primvars: str | None = None, more: str = "", bound: str = "face", scale: float = 1.0
) -> str:
    """Return the ball as a mesh.

    primvars : instead of its uv
    bound : name of its material, empty for none
    """
    uv = 'texCoord2f[] primvars:st = {} ( interpolation = "vertex" )'
    flipped = np.column_stack((BALL.uv[:, 0], 1.0 - BALL.uv[:, 1]))
    binding = f"rel material:binding = </model/{bound}>" if bound else ""
    return f"""
def Mesh "{name}" ( prepend apiSchemas = ["MaterialBindingAPI"] ) {{
    uniform token subdivisionScheme = "none"
    point3f[] points = {text_of(scale * BALL.positions)}
    int[] faceVertexCounts = {text_of(np.full(len(BALL.triangles), 3))}
    int[] faceVertexIndices = {text_of(BALL.triangles.ravel())}
    {uv.format(text_of(flipped)) if primvars is None else primvars}
    {binding}
    {more}
}}
"""


def stage(*prims: str, metadata: str = "metersPerUnit = 1") -> str:
    """Return a stage whose prims are below /model."""
    content = "\n".join(prims or (mesh(), material()))
    return f'#usda 1.0\n(\n{metadata}\n)\ndef Xform "model" {{\n{content}\n}}\n'


def write_usd(path: Path, text: str | None = None) -> Path:
    """Write a stage with its picture beside it, as the kind of file that the suffix states."""
    text = stage() if text is None else text
    path.with_name("skin.png").write_bytes(PICTURE)
    if path.suffix == ".usdz":
        return write_package(path, {"scene.usda": text.encode(), "skin.png": PICTURE})
    if path.suffix == ".usdc":
        from pxr import Sdf

        layer = Sdf.Layer.CreateAnonymous(".usda")
        layer.ImportFromString(text)
        layer.Export(str(path))
    else:
        path.write_text(text)
    return path


def write_package(path: Path, files: dict[str, bytes]) -> Path:
    """Write a package, whose first file is its root layer."""
    with zipfile.ZipFile(path, "w") as package:
        for name, data in files.items():
            package.writestr(name, data)
    return path
