"""How light is spread below the skin."""

from __future__ import annotations

from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import colour, field_choice, whole

TITLE = "Technique"
OPEN = False
_ATLASES = (256, 512, 1024, 2048, 4096)
_SAMPLES = (1, 2, 4, 8, 16)


def draw(desk: Desk) -> None:
    """The technique, its remedies, and how fine it is."""
    settings, apply = desk.state.settings, desk.state.with_settings
    for label, field in (
        ("technique", "technique"),
        ("stretch", "stretch"),
        ("seams", "seams"),
        ("transmission", "transmission"),
        ("occlusion", "occlusion"),
    ):
        field_choice(desk, label, settings, field, apply)
    if settings.seams == "clear-colour":
        colour(desk, "beside charts", settings.seam_colour, lambda found: apply(seam_colour=found))
    whole(desk, "atlas", settings.atlas, _ATLASES, lambda side: apply(atlas=side))
    whole(desk, "shadow map", settings.shadow_size, _ATLASES, lambda side: apply(shadow_size=side))
    whole(desk, "samples", settings.samples, _SAMPLES, lambda count: apply(samples=count))
