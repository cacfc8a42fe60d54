"""Captured frames for interactive web pages have fewer but wider strands of hair."""

from __future__ import annotations

from dermis import Human, Scene
from dermis.frame.capture import capture_frame, reduce_hair
from dermis.frame.renderer import Renderer
from dermis.gpu.capture import CapturedFrame, FrameCapture
from dermis.human.hair.look import HairLook
from dermis.scene.lights import studio
from dermis.scene.settings import Settings


def _strands(captured: CapturedFrame) -> tuple[int, dict[int, float]]:
    """Return the number of drawn strands, and the factors of the width by the number of grown strands."""
    records = captured.records
    (drawn,) = {int(record["coarse"]) for name, record in records if name == "StrandView"}
    widths = {int(one["coarse"]): float(one["width_scale"]) for name, one in records if name == "Hairs"}
    return drawn, widths


def test_fewer_strands_cover_the_same_area(renderer: Renderer) -> None:
    head = Human(hair=HairLook("cropped")).head(subdivide=0, hairs=0.5)
    scene = Scene(head, lights=[studio()[0]], camera="headshot")
    settings = Settings(size=(64, 64), atlas=128, samples=1, interreflection=False)
    inputs = renderer.prepare(scene, settings)
    full, reduced = (
        _strands(reduce_hair(capture_frame(FrameCapture(renderer.device), inputs), n)) for n in (0, 2)
    )
    (drawn, widths), (fewer, wider) = full, reduced
    assert len(widths) == 2 and drawn in widths and fewer == drawn // 2
    assert abs(fewer * wider[drawn] / (drawn * widths[drawn]) - 1) < 1e-3
    shadows = next(count for count in widths if count != drawn)
    assert wider[shadows] == widths[shadows]
