"""Write the graph of a frame to docs/frame_graph.md."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import dermis
from dermis.apps.validation.benchmarks.cases import pose_at_moment, with_test_rig
from dermis.apps.validation.pages import template_path
from dermis.base.command_line import run_script
from dermis.formats.samples import is_available
from dermis.gpu.graph import FrameListing, FrameListingEntry

PAGE = Path(__file__).parent.parent / "docs" / "frame_graph.md"
SETTINGS, TARGETS = dermis.Settings(size=(1920, 1080), atlas=2048), 52


def changes(scene: dermis.Scene) -> dict[str, tuple[dermis.Scene, dermis.Settings]]:
    """Return, for each column of marks in the table, the scene and settings after a change."""
    key, *others = scene.lights
    moved = key.model_copy(update={"position": tuple(c + 20.0 for c in key.position)})  # type: ignore[union-attr]
    rough = scene.skin.model_copy(update={"roughness": 0.4})
    return {
        "a pose": (replace(scene, pose=pose_at_moment(scene.head, 1)), SETTINGS),
        "camera": (replace(scene, camera=dermis.three_quarter(scene.head)), SETTINGS),
        "a light": (replace(scene, lights=(moved, *others)), SETTINGS),
        "exposure": (scene, SETTINGS.model_copy(update={"exposure": 2.0})),
        "profile": (replace(scene, skin=dermis.Skin(profile="dj3")), SETTINGS),
        "roughness": (replace(scene, skin=rough), SETTINGS),
        "size": (scene, SETTINGS.model_copy(update={"size": (1280, 720)})),
    }


def full_listing(renderer: dermis.Renderer, scene: dermis.Scene) -> FrameListing:
    """Return the listing of a frame in which all passes run."""
    renderer.graph.listing = listing = FrameListing()
    renderer.draw(scene, SETTINGS, run_all_passes=True)
    return listing


def stage_rows(listing: FrameListing, ms: dict[str, float], marks: dict[str, set[str]]) -> Iterable[str]:
    """Yield the table row of each stage.

    ms : device times of the stages [ms]
    marks : names of the stages that run after each change
    """
    for stage in dict.fromkeys(one.stage for one in listing.passes):
        own = [one for one in listing.passes if one.stage == stage]
        shaders = ", ".join(f"`{name}`" for name in dict.fromkeys(one.shader for one in own))
        cells = " | ".join("x" if stage in ran else "" for ran in marks.values())
        time = f"{ms[stage]:.3f}" if stage in ms else ""
        yield f"| {stage} | {shaders} | {len(own)} | {time} | {cells} |"


def pass_row(one: FrameListingEntry) -> str:
    """Return the table row of a pass."""
    bound = ", ".join(f"{name} {value}" for name, value in one.bindings.items() if value != "sampler")
    groups = " x ".join(map(str, one.groups))
    return f"| {'recorded' if one.recorded else ''} | {one.stage} | {one.shader} | {groups} | {bound} |"


def main(adapter: str = "auto", page: Path = PAGE) -> None:
    """Render the frames and write the page."""
    renderer = dermis.Renderer(adapter)
    name = "lee_perry_smith" if is_available("lee_perry_smith") else "human"
    scene = dermis.Scene(with_test_rig(dermis.load_head(name, subdivide=0), TARGETS))
    renderer.draw(scene, SETTINGS)
    ms = renderer.draw_after_warm_up(scene, SETTINGS).gpu_ms or {}
    listing, marks = full_listing(renderer, scene), dict[str, set[str]]()
    for change, frame in changes(scene).items():
        renderer.draw(scene, SETTINGS)
        renderer.draw(*frame)
        marks[change] = set(renderer.graph.executed_stages)
    page.write_text(
        template_path(PAGE)
        .read_text(encoding="utf-8")
        .format(
            head=name,
            adapter=f"{renderer.device.adapter.name}, {renderer.device.adapter.backend}",
            changes=" | ".join(marks),
            rule="|".join("---" for _ in marks),
            stages="\n".join(stage_rows(listing, ms, marks)),
            passes="\n".join(map(pass_row, listing.passes)),
            resources="\n".join(f"{k}. {what}" for k, what in enumerate(listing.resources)),
        ),
        encoding="utf-8",
    )


if __name__ == "__main__":
    run_script(main)
