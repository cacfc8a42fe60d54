"""How light shares itself out between the surface and the skin below it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Energy:
    """What enters and leaves the skin, with c = 1 unless `returned` divides by the mean of what leaves.

    f = (1 - loss rho_s rho_dt(n.l)) (1 - loss rho_s rho_dt(n.v)) / (pi c)

    loss : factor of the surface's albedo: 0 for no term, 1, or pi
    returned : whether light that the surface throws back inside comes out after all
    """

    loss: float
    returned: bool

    def enters(self, albedo: ArrayLike, rho_s: float) -> Floats:
        """Share of light from a direction that enters, by the surface's albedo there [-]."""
        return np.maximum(0.0, 1.0 - self.loss * rho_s * np.asarray(albedo, float))

    def leaves(self, albedo: ArrayLike, mean: ArrayLike, rho_s: float) -> Floats:
        """What leaves in a direction, of light that would leave evenly [-].

        albedo : of the surface there
        mean : albedo over all directions, weighed by their cosine
        """
        lost = self.loss * rho_s * np.asarray(mean, float) if self.returned else 0.0
        return np.asarray(self.enters(albedo, rho_s) / np.maximum(1.0 - lost, 0.5))

    def furnace(self, albedo: ArrayLike, mean: ArrayLike, rho_s: float) -> Floats:
        """Outgoing over incoming radiance of white skin under the same light from everywhere [-]."""
        inside = 1.0 - self.loss * rho_s * np.asarray(mean, float)
        return np.asarray(rho_s * np.asarray(albedo, float) + inside * self.leaves(albedo, mean, rho_s))


ENERGY: dict[str, Energy] = {
    "none": Energy(0.0, returned=False),
    "published": Energy(np.pi, returned=False),
    "full": Energy(1.0, returned=True),
}
"""By the names that scenes use.

`published` takes the book's rho_dt [dEonLuebke2007], whose lobe and integral lack 1/pi: it overstates the
loss by pi where diffuse light is divided by pi. `full` divides, and by the mean of what leaves it returns
light that the surface reflects back inside: as a matte layer under a glossy one [Kelemen2001].
"""
