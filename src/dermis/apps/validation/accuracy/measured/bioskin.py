"""Decoder of BioSkin, a published network that maps pigments to reflectance, evaluated without PyTorch."""

from __future__ import annotations

import pickle
import zipfile
from collections import OrderedDict
from pathlib import Path

import numpy as np

from dermis.apps.inverse.unmixing.spectral_inversion import ParameterValues, SpectralModel, SpectralUnknown
from dermis.base.errors import refuse
from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import WAVELENGTHS_NM

_FIRST_WAVELENGTH_NM, _WAVELENGTH_STEP_NM = 380.0, 2.0  # wavelengths of the decoder
_DECODER_INPUTS = ("melanin", "blood", "epidermis_mm", "oxygen", "eumelanin")
_MIDDLE_INPUT_VALUES = {"melanin": 0.3, "blood": 0.3, "epidermis_mm": 0.4, "oxygen": 0.7, "eumelanin": 0.74}
BIOSKIN_UNKNOWNS = {
    name: SpectralUnknown(name, 0.0, 1.0, _MIDDLE_INPUT_VALUES[name]) for name in _DECODER_INPUTS
}
"""Inputs of the decoder, scaled by its authors to the range 0 to 1; fits start from plausible values."""
BIOSKIN_UNKNOWN_SETS = (("melanin", "blood"), ("melanin", "blood", "oxygen"), _DECODER_INPUTS)
"""Names of the inputs to fit, for fits with two, three and five unknowns."""


def bioskin_model(weights_path: Path) -> SpectralModel:
    """Return BioSkin's decoder as a function from skin parameters to reflectance spectra.

    weights_path : the published file pretrained_models/BioSkin.pt

    Raises DermisError if the file is not the published one.

    Source: [Aliaga2023].
    """
    layers = _read_layers(weights_path)
    positions = (WAVELENGTHS_NM - _FIRST_WAVELENGTH_NM) / _WAVELENGTH_STEP_NM

    def decode_reflectance(parameter_values: ParameterValues) -> Floats:
        count = len(next(iter(parameter_values.values())))
        columns = (
            np.broadcast_to(parameter_values.get(name, np.float64(_MIDDLE_INPUT_VALUES[name])), count)
            for name in _DECODER_INPUTS
        )
        x = np.stack(list(columns), axis=-1)
        for name in ("fc_dec_in", "fc_dec"):
            x = np.tanh(x @ layers[f"{name}.weight"].T + layers[f"{name}.bias"])
        spectrum = 1.0 / (1.0 + np.exp(-(x @ layers["fc_dec_out.weight"].T + layers["fc_dec_out.bias"])))
        return np.asarray(spectrum[:, positions.astype(int)], np.float64)

    return decode_reflectance


class _TensorReader(pickle.Unpickler):
    """Unpickler that loads a dictionary of tensors and refuses to construct any other object."""

    def find_class(self, module_name: str, name: str) -> object:
        """Return a class or function that weight files need; raise UnpicklingError for any other name."""
        if (module_name, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return lambda storage, offset, size, *rest: (storage, offset, size)
        if (module_name, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if module_name == "torch" and name.endswith("Storage"):
            return name
        raise pickle.UnpicklingError(f"{module_name}.{name}")

    def persistent_load(self, pid: object) -> object:
        """Return `pid`, the description of a tensor's storage, unchanged."""
        return pid


def _read_layers(weights_path: Path) -> dict[str, Floats]:
    try:
        with zipfile.ZipFile(weights_path) as archive:
            root = archive.namelist()[0].split("/")[0]
            with archive.open(f"{root}/data.pkl") as file:
                tensors = _TensorReader(file).load()
            layers = {}
            for name, (storage, offset, size) in tensors.items():
                raw = np.frombuffer(archive.read(f"{root}/data/{storage[2]}"), "<f4")
                values = raw[offset : offset + int(np.prod(size))].reshape(size)
                layers[name.removeprefix("module.")] = values.astype(np.float64)
            return layers
    except (OSError, zipfile.BadZipFile, pickle.UnpicklingError, KeyError, ValueError) as fault:
        refuse(str(weights_path), "BioSkin.pt of facebookresearch/BioSkin", str(fault), "Give its path")
