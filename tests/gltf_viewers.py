"""Pictures of .glb files in viewers: three.js, Babylon.js and model-viewer in Chromium, without network."""

from __future__ import annotations

import io
import json
import mimetypes
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from chromium_input import CHROMIUM
from numpy.typing import NDArray
from PIL import Image

VIEWER_VARIABLES = {
    "three": "DERMIS_THREE",
    "babylon": "DERMIS_BABYLON",
    "model-viewer": "DERMIS_MODEL_VIEWER",
}
"""Variables that name the npm folder node_modules with each viewer."""
_ORIGIN = "http://viewer.test"
_FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
_PATIENCE_MS = 90_000
_PAGES = Path(__file__).with_name("gltf_viewer_pages")


def viewer_picture(
    viewer: str,
    file: Path,
    node_modules: Path,
    camera: Mapping[str, Any],
    light: Mapping[str, Any],
    *,
    weights: Mapping[str, float] | None = None,
    side: int = 384,
) -> NDArray[np.float64]:
    """Return the picture (side, side, 3) that a viewer draws of a .glb file, sRGB from 0 to 1.

    viewer : "three" and "babylon" draw with one parallel light, "model-viewer" in uniform light of radiance 1
    camera : "position" and "target" [m], "fov" [rad]
    light : "direction" in which light travels, "irradiance"
    weights : weights of morph targets by name, for three.js and Babylon.js
    """
    from playwright.sync_api import sync_playwright

    settings = json.dumps({"camera": dict(camera), "light": dict(light), "weights": dict(weights or {})})
    page_text = (_PAGES / f"{viewer}.html").read_text("utf-8").replace(">SETTINGS<", f">{settings}<")
    files = {"/": page_text.encode(), "/head.glb": file.read_bytes()}
    files["/uniform.hdr"] = _uniform_panorama()
    problems: list[str] = []

    def answer(route: Any) -> None:
        path = route.request.url.removeprefix(_ORIGIN).partition("?")[0]
        if route.request.url.startswith(("blob:", "data:")):
            route.continue_()
            return
        if not route.request.url.startswith(_ORIGIN):
            problems.append(f"request of {route.request.url[:200]}")
            route.abort()
            return
        kind = mimetypes.guess_type(path)[0] or ("text/html" if path == "/" else "application/octet-stream")
        inside = node_modules / path.removeprefix("/node_modules/")
        if path in files:
            route.fulfill(body=files[path], content_type=kind)
        elif path.startswith("/node_modules/") and inside.is_file():
            route.fulfill(body=inside.read_bytes(), content_type=kind)
        else:
            route.fulfill(status=404)

    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=_FLAGS)
        page = browser.new_page(viewport={"width": side, "height": side})
        page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.route("**/*", answer)
        page.goto(f"{_ORIGIN}/")
        try:
            page.wait_for_selector("html[data-state]", state="attached", timeout=_PATIENCE_MS)
        except Exception as error:
            raise AssertionError(problems) from error
        png = page.screenshot(timeout=_PATIENCE_MS)
        browser.close()
    picture = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), np.float64) / 255.0
    assert [one for one in problems if "favicon" not in one and "404" not in one] == []
    return picture


def _uniform_panorama() -> bytes:
    """Return a Radiance file of 256x128 texels of radiance 1."""
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 128 +X 256\n"
    return head + bytes((128, 128, 128, 129)) * (128 * 256)
