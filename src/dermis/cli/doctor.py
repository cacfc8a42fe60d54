"""`dermis doctor`: what this machine can do."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from dermis.base.console import print_report
from dermis.base.errors import DermisError
from dermis.cli.options import Adapter, Json, Options

if TYPE_CHECKING:
    from dermis.frame.renderer import Renderer

_LIBRARIES = ("dermis", "wgpu", "numpy", "scipy", "trimesh", "pydantic", "OpenEXR", "pillow")


def doctor(*, adapter: Adapter = "auto", as_json: Json = False) -> int:
    """Show the adapters, the one that is used and why, versions and sample data, and render a test frame.

    Exits with 0 when everything works and with 2 when not.

    For example:

        dermis doctor

        dermis doctor --adapter cpu --json
    """
    report = examine(adapter)
    print_report(as_json, report, lambda: _lines(report))
    return 0 if report["healthy"] else 2


def examine(wanted: str) -> Options:
    """Return all findings as one object for JSON."""
    from dermis.base.private import cache_folder
    from dermis.formats.samples import SAMPLES, cached
    from dermis.gpu.adapters import OPTIONAL_FEATURES, list_adapters

    found = [
        {"number": a.number, "name": a.name, "driver": a.driver, "kind": a.kind, "backend": a.backend}
        | {"features": {feature: feature in a.features for feature in OPTIONAL_FEATURES}}
        for a in list_adapters()
    ]
    return {
        **_test_adapter(wanted),
        "adapters": found,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "libraries": {name: _version(name) for name in _LIBRARIES},
        "cache": str(cache_folder()),
        "samples": {name: cached(name) for name in SAMPLES},
    }


def _version(name: str) -> str:
    """Return the version of a package; sources that were never installed have none."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _test_adapter(wanted: str) -> Options:
    """Open the adapter and draw a test frame with it."""
    from dermis.frame.renderer import Renderer
    from dermis.gpu.textures import half_store_rounding

    try:
        renderer = Renderer(wanted)
        rounding = renderer.kept_open.run(lambda: half_store_rounding(renderer.device))
        test = _self_test(renderer)
    except DermisError as error:
        return {"healthy": False, "used": None, "problem": str(error)}
    used = {
        "name": renderer.device.adapter.name,
        "backend": renderer.device.adapter.backend,
        "reason": renderer.device.reason,
        "half_store_rounding": rounding,
    }
    problem = None if test["passed"] else "the test frame is not lit as it should be"
    return {"healthy": test["passed"], "used": used, "self_test": test, "problem": problem}


def _self_test(renderer: Renderer) -> Options:
    """Draw a white sphere, lit from the camera: its middle must reflect the irradiance, and no pixel more."""
    from dermis.mesh.head import Head
    from dermis.mesh.maps import Maps
    from dermis.mesh.primitives import uv_sphere
    from dermis.scene import Camera, Scene, Settings, Skin
    from dermis.scene.lights import DirectionalLight

    lamp = DirectionalLight(direction=(0.0, 0.0, -1.0), irradiance=(3.14159, 3.14159, 3.14159))
    scene = Scene(
        Head("sphere", uv_sphere(100.0), Maps()),
        lights=(lamp,),
        camera=Camera(position=(0.0, 20.0, 1000.0), target=(0.0, 20.0, 0.0), frame_mm=240.0),
        skin=Skin(rho_s=0.0, albedo="profile"),
    )
    rendered = renderer.draw(scene, Settings(size=(128, 128), atlas=256, samples=1, shadow_size=256))
    image = rendered.linear()
    centre = float(image[60:68, 60:68].mean())
    passed = abs(centre - 1.0) < 0.02 and float(image.max()) < 1.02 and float(image[0, 0].max()) == 0.0
    return {"passed": passed, "centre": centre, "frame_ms": rendered.frame_ms}


def _lines(report: Options) -> list[str]:
    mark = {True: "yes", False: "no"}
    lines = ["adapters:"]
    for one in report["adapters"]:
        features = ", ".join(f"{name} {mark[has]}" for name, has in one["features"].items())
        lines.append(f"  #{one['number']} {one['name']}, {one['backend']} ({one['kind']}): {features}")
    if used := report["used"]:
        test = report["self_test"]
        lines.append(f"used: {used['name']}, {used['backend']}, because {used['reason']}")
        lines.append(f"half-float stores round: {used['half_store_rounding']}")
        result = "passed" if test["passed"] else "FAILED"
        lines.append(f"test frame: {result} in {test['frame_ms']:.0f} ms, centre {test['centre']:.3f} of 1")
    libraries = ", ".join(f"{name} {number}" for name, number in report["libraries"].items())
    lines.append(f"python {report['python']} on {report['platform']}; {libraries}")
    state = {True: "here", False: "not here"}
    samples = ", ".join(f"{name} {state[here]}" for name, here in report["samples"].items())
    lines += [f"cache: {report['cache']}", f"samples: {samples}"]
    return [*lines, "healthy" if report["healthy"] else f"NOT healthy: {report['problem']}"]
