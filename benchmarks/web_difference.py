"""Measure the difference between the pictures of an exported page and of `dermis render`.

Headless Chromium, on its software adapter, renders the page in its two forms. Its linear pictures are
compared with pictures by dermis that use the decoded maps of the page; these are compared with pictures by
dermis that use the original maps.
"""

from __future__ import annotations

import base64
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from web_page import FLAGS, SOFTWARE, STATE

import dermis
from dermis.apps.export.targets.web.build import PageRequest, build_page_content
from dermis.apps.export.targets.web.maps import with_reduced_maps
from dermis.apps.export.targets.web.target import page_html
from dermis.apps.validation.pages import chromium_page
from dermis.base.command_line import run_script
from dermis.base.console import print_lines
from dermis.frame.capture import capture_renderer

ATLAS_SIDE, MAP_SIDE = 512, 1024  # of the exported page [texel]
FORMS_AND_SIDES = ("software", 512), ("gpu", 256)
READ_LINEAR_PICTURE = """async () => {
  const page = dermis, frame = page.player.frame, device = page.gpuScene.device, [width, height] = frame.size;
  const buffer = device.createBuffer({ size: 16 * width * height, usage: 9 });
  const encoder = device.createCommandEncoder();
  const texture = page.gpuScene.resource(frame.linear);
  encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow: 16 * width }, [width, height]);
  device.queue.submit([encoder.finish()]);
  await buffer.mapAsync(1);
  const bytes = new Uint8Array(buffer.getMappedRange());
  let text = "";
  for (let k = 0; k < bytes.length; k += 32768) text += String.fromCharCode(...bytes.subarray(k, k + 32768));
  return btoa(text);
}"""


def main(head: str, adapter: str = "auto") -> None:
    """Print a table row for each form of the page, at the size at which it is measured."""
    scene = dermis.Scene(dermis.load_head(head))
    scene = replace(scene, head=with_reduced_maps(scene.head, MAP_SIDE))
    settings = dermis.Settings(atlas=ATLAS_SIDE)
    print_lines("| head | form | size | difference | loss by maps and hairs |", "|---|---|---|---|---|")
    for form, side in FORMS_AND_SIDES:
        settings_for = settings.model_copy(update={"size": (side, side)})
        original = capture_renderer(form, adapter).draw(scene, settings_for).linear()
        references = list[NDArray[np.float32]]()
        content = build_page_content(
            PageRequest(scene, (), settings, {form: (side,)}, adapter),
            lambda renderer, *_, settings_for=settings_for, references=references: references.append(
                renderer.draw(scene, settings_for).linear()
            ),
        )
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "head.html"
            file.write_text(page_html(content, (), head, ""), encoding="utf-8")
            picture = render_page(file, side)
        off, lost = distance(picture, references[0]), distance(references[0], original)
        print_lines(f"| {head} | {form} | {side} x {side} | {off:.2%} | {lost:.2%} |")


def render_page(file: Path, side: int) -> NDArray[np.float32]:
    """Return the (h, w, 3) linear picture that a browser renders of a page."""
    with chromium_page(side, [*FLAGS, *SOFTWARE]) as page:
        page.goto(file.as_uri())
        page.wait_for_function(f"() => {STATE} && {STATE} !== 'loading'", timeout=120_000)
        raw = base64.b64decode(page.evaluate(READ_LINEAR_PICTURE))
    return np.frombuffer(raw, np.float32).reshape(side, side, 4)[..., :3]


def distance(picture: NDArray[np.float32], reference: NDArray[np.float32]) -> float:
    """Return the relative RMSE of a picture against a reference."""
    return float(np.sqrt(((picture - reference) ** 2).mean() / (reference**2).mean()))


if __name__ == "__main__":
    run_script(main)
