"""Fresnel reflectance: Schlick's approximation and the exact curve.

The index of refraction of skin is 1.4, so it reflects 2.8 % of the light at normal incidence and all of it at
grazing angles. Schlick's approximation is good enough: the difference is shown twenty times as bright.

Deck: S6
Equation: F ≈ F₀ + (1 − F₀)(1 − V·H)⁵, F₀ = 0.028
Sources: Schlick1994
"""

import numpy as np

import dermis
from dermis.apps.gallery.panels import plot_panel
from dermis.apps.gallery.script import run_gallery_script
from dermis.specular.fresnel import dielectric, schlick


def draw(studio):
    head = studio.head()
    skins = [dermis.Skin(fresnel=name) for name in ("schlick", "exact")]
    scenes = [dermis.Scene(head, camera=dermis.three_quarter(head), skin=skin) for skin in skins]
    curve, exact = (studio.render_linear(scene) for scene in scenes)
    heads = {"Schlick": curve, "exact": exact, "20 × |difference|": 20 * np.abs(exact - curve)}
    return {"reflectance by angle": plot_panel(curves)} | heads


def curves(axes):
    degrees = np.linspace(0, 90, 500)
    approximate, exact = (law(np.cos(np.radians(degrees))) for law in (schlick, dielectric))
    axes.plot(degrees, approximate, label="Schlick, F₀ = 0.028")
    axes.plot(degrees, exact, label="exact, index 1.4")
    axes.plot(degrees, 10 * np.abs(approximate - exact), color="grey", label="10 × difference")
    axes.set(xlabel="angle of view and half vector [°]", ylabel="reflectance", xlim=(0, 90), ylim=(0, 1))
    axes.legend(frameon=False)


if __name__ == "__main__":
    run_gallery_script(draw)
