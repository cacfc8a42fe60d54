"""One layer, three layers and the published six Gaussians: python gallery/06_layers.py OUTPUT.

Each profile is divided by its total. The three-layer coefficients as they are printed do not give the
published sum, in whatever unit they are read.
"""

import sys

from matplotlib.figure import Figure

import dermis

PROFILES = {
    "one layer (skin1, dipole)": dermis.load_tissue("skin1").profile("dipole"),
    "three layers (dj3, multipole)": dermis.load_tissue("dj3").profile("multipole"),
    "three layers (dj3, layered diffusion)": dermis.load_tissue("dj3").profile("layered"),
}
TABLE = dermis.load_profile("gpu-gems-3")

figure = Figure(figsize=(10, 3.8), dpi=120, layout="constrained")
panels = figure.subplots(1, 3, sharey=True)
for channel, (axes, name) in enumerate(zip(panels, ("red", "green", "blue"), strict=True)):
    for (label, profile), style in zip(PROFILES.items(), (":", "--", "-"), strict=True):
        r = profile.radius_mm
        axes.plot(r, r * profile.reflectance[:, channel] / profile.total[channel], style, label=label)
    published = r * TABLE.radiant_exitance(r)[:, channel]
    axes.plot(r, published, color="black", linewidth=1.6, label="six published Gaussians")
    axes.set(xscale="log", xlim=(3e-3, 20), ylim=(0, 0.9), xlabel="r [mm]", title=name)
    axes.grid(alpha=0.25)
panels[0].set_ylabel("r R(r) / total [1/mm]")
panels[0].legend(frameon=False, fontsize=8)
figure.savefig(sys.argv[1])
