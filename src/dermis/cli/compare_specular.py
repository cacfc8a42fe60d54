"""`dermis compare specular`: the models of the surface against each other, in numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dermis.cli.console import print_json, print_lines, working_on

_DEGREES = (0, 30, 60, 75, 85)


def compare_specular(output: Path | None, roughness: float, adapter: str, as_json: bool) -> None:
    """Print what surface models reflect and cost, and draw their lobes into a folder if there is one."""
    from dermis.cli.options import check
    from dermis.scene.skin import Skin

    check(Skin, {"roughness": roughness})
    if output is not None:
        from dermis.cli.specular_plot import draw

        draw(output, roughness)
    with working_on("measuring"):
        report = _specular(adapter)
    if as_json:
        print_json(report)
    else:
        print_lines(*_lines(report, roughness))


def _specular(adapter: str) -> dict[str, Any]:
    """All findings as one JSON-ready object."""
    from dermis.benchmark.lobe_cost import lobe_cost_ns
    from dermis.gpu import open_device
    from dermis.gpu.device import gpu_failures
    from dermis.specular.comparison import albedo_rows, reciprocity_error
    from dermis.specular.fresnel import FRESNEL, hemispherical_reflectance
    from dermis.specular.models import MODELS

    device = open_device(adapter)
    with gpu_failures(device):
        cost = lobe_cost_ns(device)
    return {
        "adapter": device.adapter.name,
        "hemispherical_fresnel": {name: hemispherical_reflectance(curve) for name, curve in FRESNEL.items()},
        "models": {
            name: {
                "note": model.note,
                "reciprocal": model.reciprocal,
                "albedo": albedo_rows(name),
                "reciprocity_error": reciprocity_error(name),
                "gpu_ns": cost[name, "schlick"],
                "gpu_ns_exact_fresnel": cost[name, "exact"],
            }
            for name, model in MODELS.items()
        },
    }


def _lines(report: dict[str, Any], m: float) -> list[str]:
    import numpy as np

    from dermis.specular.albedo import directional_albedo
    from dermis.specular.comparison import peak
    from dermis.specular.models import MODELS

    cosine = np.cos(np.radians(_DEGREES))
    angles = "".join(f"{f'{angle}°':>8}" for angle in _DEGREES)
    lines = [
        f"roughness {m:g}, rho_s 1, Schlick's Fresnel; cost of an evaluation on {report['adapter']}",
        "",
        f"{'model':24}{'peak':>8}{angles}{'reciprocity':>13}{'cost':>10}{'exact':>10}",
        f"{'':24}{'1/sr':>8}{'share reflected in all directions':>40}{'error':>13}{'ns':>10}{'ns':>10}",
    ]
    for name, found in report["models"].items():
        rho = "".join(f"{value:8.4f}" for value in directional_albedo(cosine, m, MODELS[name].lobe))
        costs = "".join(f"{found[key]:10.3g}" for key in ("gpu_ns", "gpu_ns_exact_fresnel"))
        lines.append(f"{name:24}{peak(name, m):8.4f}{rho}{found['reciprocity_error']:13.0e}{costs}")
    one_way = [(name, found["note"]) for name, found in report["models"].items() if not found["reciprocal"]]
    smooth = report["hemispherical_fresnel"]
    return [
        *lines,
        "",
        *(f"{name}: {note}." for name, note in one_way),
        f"A smooth surface of index 1.4 reflects {smooth['exact']:.1%} of light from everywhere "
        f"({smooth['schlick']:.1%} by Schlick's curve); the talk says up to 6 %.",
    ]
