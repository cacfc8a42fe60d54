"""Find the heart rate in clips of `tools/pulse_clips.py` by POS, CHROM and networks of open-rppg.

    python tools/pulse_rates.py CLIPS --networks FacePhys.rlap PhysNet.pure --noise 2

Needs NumPy, and for networks open-rppg (`pip install open-rppg "setuptools<81"`). Its code is under the MIT
licence. Its weights were trained on the data sets RLAP and PURE, which are licensed for research only: check
their terms before you use the networks for more than a check.
"""

from __future__ import annotations

import bz2
import json
import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
LEVELS = 4095
BAND_PER_MIN = 40.0, 180.0
MOST_ERROR_PER_MIN = 2.0


def pos(colours: Doubles, rate_hz: float) -> Doubles:
    """Return the pulse from mean colours (n, 3) by the plane orthogonal to the skin tone [Wang 2017]."""
    length, found = round(1.6 * rate_hz), np.zeros(len(colours))
    for begin in range(len(colours) - length + 1):
        r, g, b = (colours[begin : begin + length] / colours[begin : begin + length].mean(axis=0)).T
        x, y = g - b, g + b - 2 * r
        window = x + x.std() / y.std() * y
        found[begin : begin + length] += window - window.mean()
    return found


def chrom(colours: Doubles, rate_hz: float) -> Doubles:
    """Return the pulse from mean colours (n, 3) by the difference of two chrominances [de Haan 2013]."""
    r, g, b = (colours / colours.mean(axis=0)).T
    x, y = 3 * r - 2 * g, 1.5 * r + g - 1.5 * b
    return np.asarray(x - x.std() / y.std() * y)


def spectral_peak_per_min(signal: Doubles, rate_hz: float) -> float:
    """Return the frequency of the spectral peak in the band of heart rates, interpolated by zero padding."""
    windowed = (signal - signal.mean()) * np.hanning(len(signal))
    power = np.abs(np.fft.rfft(windowed, 1 << 15))
    frequency = 60 * np.fft.rfftfreq(1 << 15, 1 / rate_hz)
    band = (frequency > BAND_PER_MIN[0]) & (frequency < BAND_PER_MIN[1])
    return float(frequency[band][power[band].argmax()])


def read_clips(folder: Path, noise: float) -> Iterator[tuple[dict[str, Any], NDArray[np.int16]]]:
    """Yield the record of each clip and its pictures (n, h, w, 3) of 12 bits with Gaussian noise."""
    rng = np.random.default_rng(0)
    for path in sorted(folder.glob("*.json"), key=lambda path: int(path.stem)):
        record = json.loads(path.read_text())
        differences = np.frombuffer(bz2.decompress(path.with_suffix(".bz2").read_bytes()), np.int16)
        pictures = np.cumsum(differences.reshape(record["shape"]), axis=0, dtype=np.int16)
        for picture in pictures if noise else ():
            noisy = picture + noise * LEVELS / 255 * rng.standard_normal(picture.shape, np.float32)
            picture[:] = np.clip(np.rint(noisy), 0, LEVELS)
        yield record, pictures


def skin_mask(pictures: NDArray[np.int16]) -> NDArray[np.bool_]:
    """Return pixels in the middle of the picture that differ from the grey background and change little."""
    first = pictures[0].astype(np.float64)
    height, width = first.shape[:2]
    y, x = np.ogrid[:height, :width]
    oval = ((x - width / 2) / (0.22 * width)) ** 2 + ((y - height / 2) / (0.3 * height)) ** 2 < 1
    mask: NDArray[np.bool_] = oval & (first[..., 0] > first[..., 2]) & (first.min(axis=-1) > 0)
    return mask


def network_signals(model: Any, pictures: NDArray[np.int16], rate_hz: float) -> dict[str, Doubles]:
    """Return the signals of a network of open-rppg for pictures of 8 bits and of 12 bits.

    The network's own preparation accepts bytes only: it crops and shrinks them to bytes. The pictures of 12
    bits are cropped by the same detector once and shrunk to floats.
    """
    import cv2  # type: ignore[import-not-found]

    eight = np.rint(pictures * (255 / LEVELS)).astype(np.uint8)
    model.process_video_tensor(eight, fps=rate_hz)
    signals = {"8": np.asarray(model.bvp()[0], np.float64)}
    (left, top, right, bottom), _, _ = model.detector.detect(eight[0])[0]
    crop = slice(max(round(top), 0), round(bottom)), slice(max(round(left), 0), round(right))
    side = model.input[1:3]
    with model:
        for k, picture in enumerate(pictures):
            face = np.ascontiguousarray(picture[crop], np.float32) * (255 / LEVELS)
            small = cv2.resize(face, side, interpolation=cv2.INTER_AREA)
            model.update_face_resized(lambda small=small: small, ts=k / rate_hz, hasface=True)
    return signals | {"12": np.asarray(model.bvp()[0], np.float64)}


def print_line(text: str) -> None:
    """Write a line to the standard output at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main() -> None:
    """Print the rates that each method finds, and how many are right."""
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--networks", nargs="*", default=[], help="networks of open-rppg")
    parser.add_argument(
        "--noise", type=float, default=0, help="standard deviation of noise [levels of 8 bits]"
    )
    given = parser.parse_args()
    models = {}
    if given.networks:
        import rppg  # type: ignore[import-not-found]

        models = {name: rppg.Model(name) for name in given.networks}
    methods: dict[str, Callable[[Doubles, float], Doubles]] = {"POS": pos, "CHROM": chrom}
    names = [f"{name} {bits}" for name in (*methods, *models) for bits in ("8", "12")]
    print_line("ITA  true  " + "  ".join(names))
    correct, clips = dict.fromkeys(names, 0), 0
    for record, pictures in read_clips(given.folder, given.noise):
        rate_hz, found = record["rate_hz"], {}
        mask = skin_mask(pictures)
        for bits, levels in (("8", 255), ("12", LEVELS)):
            colours = np.array([np.rint(one[mask] * (levels / LEVELS)).mean(axis=0) for one in pictures])
            for name, method in methods.items():
                found[f"{name} {bits}"] = spectral_peak_per_min(method(colours, rate_hz), rate_hz)
        for name, model in models.items():
            for bits, signal in network_signals(model, pictures, rate_hz).items():
                found[f"{name} {bits}"] = spectral_peak_per_min(signal, model.fps)
        clips += 1
        for name, rate in found.items():
            correct[name] += abs(rate - record["rate_per_min"]) <= MOST_ERROR_PER_MIN
        rates = "  ".join(f"{found[name]:.1f}" for name in names)
        print_line(f"{record['ita_deg']:4.0f}  {record['rate_per_min']:5.1f}  {rates}")
    counts = ", ".join(f"{name} {correct[name]}" for name in names)
    print_line(f"within {MOST_ERROR_PER_MIN:g} beats a minute, of {clips}: {counts}")


if __name__ == "__main__":
    main()
