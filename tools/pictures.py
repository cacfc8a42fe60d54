"""Runs gallery scripts and puts their pictures, as WebP, where the documentation shows them.

python tools/pictures.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parent.parent
PICTURES = {
    "01_portrait": "portrait",
    "02_scattering": "scattering",
    "03_pores": "pores",
    "05_skin_colours": "skin-colours",
    "06_layers": "layers",
    "07_bust": "bust",
    "08_family": "family",
    "09_lobes": "lobes",
    "10_regions": "regions",
    "11_fresnel": "fresnel",
    "12_environments": "environments",
    "13_gamma": "gamma",
    "14_energy": "energy",
    "15_tinted": "tinted",
    "16_area_lights": "area-lights",
    "17_seams": "seams",
    "18_thin_parts": "thin-parts",
    "19_techniques": "techniques",
}
QUALITY = 88


def main() -> None:
    """Make every picture anew."""
    folder = ROOT / "docs" / "images"
    folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        for script, name in PICTURES.items():
            png = Path(temporary) / f"{name}.png"
            subprocess.run([sys.executable, ROOT / "gallery" / f"{script}.py", png], check=True)
            Image.open(png).save(folder / f"{name}.webp", quality=QUALITY, method=6)


if __name__ == "__main__":
    main()
