"""A narrow white beam on a slab of skin.

The beam enters at the centre; red light leaves up to a centimetre away. The upper half shows a Monte Carlo
simulation, the lower half the six Gaussians that a frame uses. Each picture is 8 mm wide, exposed so that red
is equally bright at one millimetre from the beam.

Deck: S14
Sources: DonnerJensen2005, Wang1995
"""

import numpy as np

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.apps.truths.slab_mc import monte_carlo_profile

HALF_MM, EXPOSED_MM, PHOTONS = 4.0, 1.0, 400_000


def draw(studio):
    panels = {}
    for name in ("dj3", "skin1", "skin2"):
        counted = monte_carlo_profile(dermis.load_tissue(name).medium, photons=PHOTONS)
        panels[name] = spot(counted, dermis.load_profile(name), studio.side)
    return panels


def spot(counted, fitted, side):
    x = (np.arange(side) + 0.5) / side * 2 * HALF_MM - HALF_MM
    r = np.hypot(x[None, :], x[:, None])
    photons = [np.interp(r, counted.radius_mm, channel) for channel in counted.reflectance.T]
    upper = (x < 0)[:, None, None]
    exitance = np.where(upper, np.stack(photons, axis=-1), fitted.radiant_exitance(r))
    return np.float32(0.5 * exitance / np.interp(EXPOSED_MM, counted.radius_mm, counted.reflectance[:, 0]))


if __name__ == "__main__":
    run_gallery_script(draw)
