"""Schlick's curve against the exact one of index 1.4: python gallery/11_fresnel.py OUTPUT [HEAD].

Left: reflectance by angle. Right: the head with Schlick's, with the exact one, and 20 times their difference.
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import dermis
from dermis.images.colour import encode_srgb8
from dermis.specular.fresnel import dielectric, schlick

head = dermis.load_head(*(sys.argv[2:] or ["lee_perry_smith"]), subdivide=1)
renderer = dermis.Renderer()
skins = [dermis.Skin(fresnel=name) for name in ("schlick", "exact")]
scenes = [dermis.Scene(head, camera=dermis.three_quarter(head), skin=skin) for skin in skins]
curve, exact = (renderer.render(scene, size=(512, 512), atlas=1024) for scene in scenes)

figure = Figure(figsize=(15.2, 3.9), dpi=130, layout="constrained")
axes, *panels = figure.subplots(1, 4)
degrees = np.linspace(0, 90, 500)
cosine = np.cos(np.radians(degrees))
axes.plot(degrees, schlick(cosine), label="Schlick, F₀ = 0.028")
axes.plot(degrees, dielectric(cosine), label="exact, index 1.4")
axes.plot(degrees, 10 * np.abs(schlick(cosine) - dielectric(cosine)), color="grey", label="10 × difference")
axes.set(xlabel="angle between view and half vector [°]", ylabel="share reflected", xlim=(0, 90), ylim=(0, 1))
axes.grid(alpha=0.25)
axes.legend(frameon=False, fontsize=9)
shown = {"Schlick": curve, "exact": exact, "20 × |difference|": 20 * np.abs(exact - curve)}
for panel, (title, image) in zip(panels, shown.items(), strict=True):
    panel.imshow(encode_srgb8(image))
    panel.set_title(title)
    panel.set_axis_off()
figure.savefig(sys.argv[1])
