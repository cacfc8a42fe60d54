"""A surface lobe from outside the package, constant in all directions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import SpecularModel

ALBEDO = 0.5


def chalk(cosines: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the BRDF, albedo / pi [1/sr]."""
    value = np.broadcast_to(ALBEDO / np.pi, np.broadcast_shapes(cosines.n_l.shape, np.shape(m)))
    return np.where(cosines.is_above, value, 0.0)


CHALK = SpecularModel(chalk, "the same in all directions", True, ("Phong1975",), {"chalk_albedo": ALBEDO})
