"""One Gaussian cannot match a profile, a sum of six can.

r R(r) of three-layer skin in red, green and blue: the model, the best single Gaussian, and six Gaussians with
the same variances for all colours.

Deck: S14
Equation: R(r) ≈ Σ_k w_k G(v_k, r), G(v, r) = exp(−r²/2v) / 2πv
Sources: dEonLuebke2007, DonnerJensen2005
"""

from functools import partial

import dermis
from dermis.apps.gallery.panels import plot_panel
from dermis.apps.gallery.script import run_gallery_script
from dermis.optics.fits.gaussian import single_gaussian

INKS = {"red": "#ff6b5e", "green": "#58d68d", "blue": "#5dade2"}


def draw(studio):
    profile, six = dermis.load_tissue("dj3").profile(), dermis.load_profile("dj3")
    one, r = single_gaussian(six), profile.radius_mm

    def curves(channel, ink, axes):
        layers = r * profile.reflectance[:, channel]
        axes.plot(r, layers, color=ink, linewidth=5, alpha=0.5, label="layers")
        axes.plot(r, r * six.radiant_exitance(r)[:, channel], "w-", linewidth=1, label="six Gaussians")
        axes.plot(r, r * one.radiant_exitance(r)[:, channel], "w:", linewidth=1, label="one Gaussian")
        axes.set(xscale="log", xlim=(3e-3, 20), ylim=(0, None), xlabel="r [mm]", ylabel="r R(r) [1/mm]")
        axes.legend(frameon=False)

    inks = enumerate(INKS.items())
    return {name: plot_panel(partial(curves, channel, ink)) for channel, (name, ink) in inks}


if __name__ == "__main__":
    run_gallery_script(draw)
