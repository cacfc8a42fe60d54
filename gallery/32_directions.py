"""Direction-independent and direction-dependent diffuse reflection.

A Lambertian surface reflects the same in all directions. A half-space of tissue reflects more of the light at
grazing incidence, and singly scattered light leaves mostly at grazing angles: cheeks look flatter, outlines
and shadow edges brighter. Beside both a path-traced picture, and their relative RMSE from it. Without surface
reflection.

Deck: +
Sources: Chandrasekhar1960, Jensen2001, Jakob2022
"""

from importlib.util import find_spec

from dermis.apps.gallery.script import run_gallery_script
from dermis.apps.validation.comparisons.compare import compare

TECHNIQUE = "texture-space"


def draw(studio):
    traced = find_spec("mitsuba") is not None
    against = "path-traced" if traced else "surface-integral"  # which only sets the exposure
    settings, panels = studio.settings(0.6), {}
    for direction in ("lambertian", "half-space"):
        comparison = compare(studio.head(), against, (TECHNIQUE,), settings=settings, direction=direction)
        label = f"{direction}: {comparison.rows[0].relrmse:.1%}" if traced else direction
        panels[label] = comparison.tone_mapped(comparison.images[TECHNIQUE])
    if traced:
        panels["path traced"] = comparison.tone_mapped(comparison.reference.image)
    return {label: (255 * image).round().astype("uint8") for label, image in panels.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
