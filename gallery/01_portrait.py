"""The whole technique in studio light.

White, rough reflection over light that has scattered below the surface: pores stay sharp in the highlights,
shadow edges turn soft and red, thin parts glow.

Deck: S1, S7, S25
Equation: L = (1 − ρ_s ρ_dt(N·V)) Σ_k w_k (E ∗ G_k) albedo^(1−mix) / π + Σ_lights E f_r(L, V) max(N·L, 0)
Sources: dEonLuebke2007, Dudash2007
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script


def draw(studio):
    head = studio.head()
    scene = dermis.Scene(head, camera=dermis.portrait(head))
    return {"": studio.render(scene, scale=2, atlas=2048, samples=8)}


if __name__ == "__main__":
    run_gallery_script(draw)
