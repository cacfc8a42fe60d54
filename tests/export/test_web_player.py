"""The WebGPU page in Chromium: pictures, selection of passes, input, and policy."""

from __future__ import annotations

import base64
import html
import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from chromium_input import CHROMIUM
from numpy.typing import NDArray
from rigged_head import write_rigged_head
from small_head import write_head

import dermis
from dermis.apps.export.run import export_skin
from dermis.apps.export.targets.pages.html import csp_hash
from dermis.apps.export.targets.web.build import PageContent, PageRequest, build_page_content
from dermis.apps.export.targets.web.sliders import Slider, scene_sliders
from dermis.apps.export.targets.web.target import PLAYER_MODULES, page_html, player_script
from dermis.frame.renderer import Renderer

FLAGS = ["--no-sandbox", "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]
MODULES_FOLDER = Path(str(dermis.__file__)).parent / "apps/export/targets/web"
SETTINGS = dermis.Settings(atlas=128, shadow_size=128, strands=False)
SIDE = 96
LIMIT = 0.005  # relative RMSE
HOSTILE = "</script><script>alert(1)</script>"
STATE = "document.documentElement.dataset.state"
LINEAR = """async () => {
  const page = dermis, frame = page.player.frame, device = page.gpuScene.device, [width, height] = frame.size;
  const bytesPerRow = 16 * width;
  const buffer = device.createBuffer({ size: bytesPerRow * height, usage: 9 });
  const encoder = device.createCommandEncoder();
  const texture = page.gpuScene.resource(frame.linear);
  encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow }, [width, height]);
  device.queue.submit([encoder.finish()]);
  await buffer.mapAsync(1);
  return btoa(Array.from(new Uint8Array(buffer.getMappedRange()), (c) => String.fromCharCode(c)).join(""));
}"""


class OpenPage(NamedTuple):
    """Page in a browser, with its scene and a renderer whose maps are those that the page decodes."""

    page: Any
    scene: dermis.Scene
    renderer: Renderer
    sliders: tuple[Slider, ...]

    def linear(self) -> NDArray[np.float32]:
        """Return the linear picture (h, w, 3) that the page has drawn."""
        raw = base64.b64decode(self.page.evaluate(LINEAR))
        return np.frombuffer(raw, np.float32).reshape(SIDE, SIDE, 4)[..., :3]

    def run(self, script: str) -> list[str]:
        """Run a script in the page and return the stages that were drawn for it."""
        self.page.evaluate(f"async () => {{ {script}; await dermis.idle(); }}")
        return list(self.page.evaluate("dermis.player.ran"))

    def error(self, scene: dermis.Scene) -> float:
        """Return the relative RMSE against a rendering of a scene."""
        settings = SETTINGS.model_copy(update={"size": (SIDE, SIDE)})
        expected = self.renderer.draw(scene, settings).linear()
        return float(np.sqrt(((self.linear() - expected) ** 2).mean() / (expected**2).mean()))


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    sync = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("there is no Chromium here")
    with sync.sync_playwright() as play:
        one = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield one
        one.close()


class CapturedPage(NamedTuple):
    """Content of a page, and the renderer that captured it."""

    content: PageContent
    scene: dermis.Scene
    renderer: Renderer
    sliders: tuple[Slider, ...]


def capture_page(scene: dermis.Scene, adapter_kind: str, sliders: tuple[Slider, ...]) -> CapturedPage:
    renderers: list[Renderer] = []
    request = PageRequest(
        scene, sliders, SETTINGS, {adapter_kind: (SIDE,)}, os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
    )
    content = build_page_content(request, lambda renderer, *_: renderers.append(renderer))
    return CapturedPage(content, scene, renderers[0], sliders)


def open_page(browser: Any, one: CapturedPage, folder: Path) -> OpenPage:
    """Return a page that has been drawn once."""
    file = folder / "head.html"
    file.write_text(page_html(one.content, one.sliders, "head", ""), encoding="utf-8")
    page = browser.new_page(viewport={"width": SIDE, "height": SIDE}, offline=True)
    page.goto(file.as_uri())
    page.wait_for_function(f"() => {STATE} && {STATE} !== 'loading'", timeout=120_000)
    assert page.evaluate(f"{STATE} + document.getElementById('told').textContent") == "drawn"
    return OpenPage(page, one.scene, one.renderer, one.sliders)


@pytest.fixture(scope="module")
def rigged_capture(tmp_path_factory: pytest.TempPathFactory) -> CapturedPage:
    file = write_rigged_head(tmp_path_factory.mktemp("rigged") / "rigged.glb")
    scene = dermis.Scene(dermis.load_head(file, subdivide=0))
    return capture_page(scene, "gpu", scene_sliders(scene))


@pytest.fixture(scope="module")
def rigged(browser: Any, rigged_capture: CapturedPage, tmp_path_factory: pytest.TempPathFactory) -> OpenPage:
    return open_page(browser, rigged_capture, tmp_path_factory.mktemp("pages"))


def test_a_browser_draws_the_same_picture(rigged: OpenPage) -> None:
    picture = rigged.linear()
    assert picture.mean() > 0.02
    assert rigged.error(rigged.scene) < LIMIT


@pytest.mark.parametrize("name", ["human:7", "head.obj"])
def test_software_program_draws_the_same_picture(browser: Any, name: str, tmp_path: Path) -> None:
    file = write_head(tmp_path / "head.obj")
    head = dermis.load_head(file if name == file.name else name, subdivide=0)
    one = open_page(browser, capture_page(dermis.Scene(head), "software", ()), tmp_path)
    # The browser's rasteriser moves corners to sixteenths of a pixel: a sample more or less at outlines.
    assert one.error(one.scene) < 3.0 * LIMIT
    one.page.close()


def test_camera_rotation_keeps_the_light(rigged: OpenPage) -> None:
    ran = rigged.run("dermis.state.yaw = 0.4; dermis.state.zoom = 0.8; dermis.touch()")
    assert set(ran) == {"visibility", "shade", "post"}
    x, y, z = np.subtract(rigged.scene.camera.position, rigged.scene.camera.target)
    around, level = np.arctan2(x, z) + 0.4, np.hypot(x, z)
    offset = np.array([level * np.sin(around), y, level * np.cos(around)])
    position = tuple(0.8 * offset + rigged.scene.camera.target)
    camera = rigged.scene.camera.model_copy(
        update={"position": position, "frame_mm": 0.8 * rigged.scene.camera.frame_mm}
    )
    assert rigged.error(replace(rigged.scene, camera=camera)) < LIMIT
    rigged.run("dermis.state.yaw = 0; dermis.state.zoom = 1; dermis.touch()")
    assert rigged.error(rigged.scene) < LIMIT


def test_dragged_light_moves_its_shadows(rigged: OpenPage) -> None:
    ran = rigged.run("dermis.state.lightYaw = 0.9; dermis.touch()")
    assert "shadows" in ran and "visibility" not in ran
    key, *others = rigged.scene.lights
    x, y, z = np.subtract(key.position, key.target)  # type: ignore[union-attr]
    around, level = np.arctan2(x, z) + 0.9, np.hypot(x, z)
    position = tuple(np.array([level * np.sin(around), y, level * np.cos(around)]) + key.target)  # type: ignore[union-attr]
    lights = (key.model_copy(update={"position": position}), *others)
    assert rigged.error(replace(rigged.scene, lights=lights)) < LIMIT
    rigged.run("dermis.state.lightYaw = 0; dermis.touch()")


def test_sliders_are_exact_at_their_nodes(rigged: OpenPage) -> None:
    rough = next(one for one in rigged.sliders if one.name == "roughness")
    ran = rigged.run(f"dermis.state.dials.roughness = {rough.values[-1]}; dermis.touch()")
    assert "shade" in ran and "stretch" not in ran
    scene = rough.scenes[-1]
    assert scene is not None and rigged.error(scene) < LIMIT < rigged.error(rigged.scene)
    assert rigged.run(f"dermis.state.dials.roughness = {rough.default_value}; dermis.touch()")
    assert rigged.run("dermis.touch()") == []


def test_memory_stays_flat_in_motion(rigged: OpenPage) -> None:
    count = "dermis.gpuScene.resources.filter(Boolean).length"
    before = rigged.page.evaluate(count)
    rigged.run(
        "for (let k = 0; k < 8; k++) { dermis.state.yaw += 0.01; dermis.touch(); await dermis.idle(); }"
    )
    assert rigged.page.evaluate(count) == before
    rigged.run("dermis.state.yaw = 0; dermis.touch()")


def test_lost_gpu_device_is_recreated(rigged: OpenPage) -> None:
    rigged.page.evaluate("dermis.reopen()")
    assert rigged.error(rigged.scene) < LIMIT


def test_page_loads_nothing_and_escapes_user_text(rigged_capture: CapturedPage) -> None:
    text = page_html(rigged_capture.content, rigged_capture.sliders, HOSTILE, HOSTILE)
    policy = html.unescape(re.search(r'Security-Policy" content="([^"]*)"', text)[1])  # type: ignore[index]
    script, style = (
        re.search(rf"<{tag}>(.*?)</", text, re.DOTALL)[1] for tag in ('script type="module"', "style")
    )  # type: ignore[index]
    assert policy.startswith("default-src 'none'") and "unsafe" not in policy and "connect" not in policy
    assert csp_hash(script) in policy and csp_hash(style) in policy
    assert re.findall(r"https?://", text) == [] and "<script>alert" not in text
    assert text.count("<script") == text.count("</script>") == 4


def test_skin_without_head_is_refused(tmp_path: Path) -> None:
    with pytest.raises(dermis.DermisError, match="a head"):
        export_skin("skin1", "web", tmp_path / "page.html")
    assert list(tmp_path.iterdir()) == []


def test_modules_are_concatenated_in_order() -> None:
    assert {f"{name}.js" for name in PLAYER_MODULES} == {file.name for file in MODULES_FOLDER.glob("*.js")}
    assert not re.search(r"^(import|export) ", player_script(), re.MULTILINE)
    names = re.findall(r"^(?:async function|function|class|const|let) (\w+)", player_script(), re.MULTILINE)
    assert len(names) > 40 and len(names) == len(set(names))


def test_player_passes_type_checking() -> None:
    folder = os.environ.get("DERMIS_TYPESCRIPT")
    if folder is None or shutil.which("node") is None:
        pytest.skip("DERMIS_TYPESCRIPT does not name the folder node_modules with TypeScript")
    command = [
        "node",
        str(Path(folder) / "typescript/bin/tsc"),
        "--noEmit",
        "--checkJs",
        "--allowJs",
        "--strict",
    ]
    command += ["--target", "esnext", "--module", "esnext", "--moduleResolution", "bundler", "--types", ""]
    files = [*MODULES_FOLDER.glob("*.js"), *MODULES_FOLDER.glob("*.d.ts")]
    done = subprocess.run([*command, *map(str, files)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
