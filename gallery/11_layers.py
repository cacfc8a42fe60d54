"""One layer looks like wax, three like skin.

A single layer (skin1) and three layers (dj3): their profiles, and the shadow of a nose with both. The
published coefficients of the three layers do not give the six published Gaussians in any unit.

Deck: S12
Sources: Jensen2001, DonnerJensen2005, dEonLuebke2007
"""

import dermis
from dermis.apps.gallery.panels import plot_panel
from dermis.apps.gallery.script import run_gallery_script

MODELS = {"one layer (skin1)": ("skin1", "dipole"), "three layers (dj3)": ("dj3", "multipole")}
INKS = ("#ff6b5e", "#58d68d", "#5dade2")


def draw(studio):
    head = studio.head()
    key = dermis.PointLight(position=(-620, 420, 620), irradiance=(3.4, 3.3, 3.1))
    near = dermis.portrait(head).model_copy(update={"target": (14.0, -28.0, 90.0), "frame_mm": 110.0})
    skins = {label: dermis.Skin(profile=tissue) for label, (tissue, _) in MODELS.items()}
    heads = {name: studio.render(dermis.Scene(head, [key], near, skin)) for name, skin in skins.items()}
    return {"normalised profiles": plot_panel(curves)} | heads


def curves(axes):
    published = dermis.load_profile("gpu-gems-3")
    for (tissue, model), style in zip(MODELS.values(), (":", "-"), strict=True):
        profile = dermis.load_tissue(tissue).profile(model)
        r = profile.radius_mm
        for channel, ink in enumerate(INKS):
            axes.plot(r, r * profile.reflectance[:, channel] / profile.total[channel], style, color=ink)
            axes.plot(r, r * published.radiant_exitance(r)[:, channel], "--", color=ink, linewidth=0.7)
    axes.set(xscale="log", xlim=(3e-3, 20), ylim=(0, 0.9), xlabel="r [mm]", ylabel="r R(r) / total [1/mm]")
    axes.set_title("dotted one layer, full three, dashed published", fontsize=9)


if __name__ == "__main__":
    run_gallery_script(draw)
