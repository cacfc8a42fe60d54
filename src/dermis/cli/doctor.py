"""The command `dermis doctor`: diagnosis of this machine."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from dermis.base.console import print_report
from dermis.base.errors import DermisError
from dermis.cli.options import AdapterOption, JsonOption, Options

if TYPE_CHECKING:
    from dermis.frame.renderer import Renderer

_REPORTED_PACKAGES = ("dermis", "wgpu", "numpy", "scipy", "pydantic", "OpenEXR", "pillow")


def doctor(*, adapter: AdapterOption = "auto", as_json: JsonOption = False) -> int:
    """List graphics adapters, versions and sample data, and render a test frame.

    The command also reports which adapter is used, and why; without one, what to install on each system.

    The exit status is 0 if everything works, otherwise 2.

    For example:

        dermis doctor

        dermis doctor --adapter cpu --json

    Parameters
    ----------
    as_json:
        Print one JSON object with all results.
    """
    report = diagnose(adapter)
    print_report(as_json, report, lambda: _report_lines(report))
    return 0 if report["healthy"] else 2


def diagnose(adapter: str) -> Options:
    """Return the diagnosis of this machine for JSON: adapters, library versions, test frame and samples.

    The entry "drivers" says what to install on each system; it is left out if it is not needed.
    """
    from dermis.base.private import cache_folder
    from dermis.formats.samples import SAMPLES, is_available
    from dermis.gpu.adapters import OPTIONAL_FEATURES, list_adapters
    from dermis.gpu.drivers import all_driver_advice

    adapters = [
        {"number": one.number, "name": one.name, "driver": one.driver, "kind": one.kind}
        | {"backend": one.backend}
        | {"features": {feature: feature in one.features for feature in OPTIONAL_FEATURES}}
        for one in list_adapters()
    ]
    kinds = [one["kind"] for one in adapters if one["backend"] != "OpenGL"]
    has_driver = "CPU" in kinds if adapter == "cpu" else bool(kinds)
    tested = _test_adapter(adapter)
    return {
        **tested,
        **({} if has_driver or tested["healthy"] else {"drivers": all_driver_advice()}),
        "adapters": adapters,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "libraries": {name: _package_version(name) for name in _REPORTED_PACKAGES},
        "cache": str(cache_folder()),
        "samples": {name: is_available(name) for name in SAMPLES},
    }


def _package_version(package_name: str) -> str:
    """Return the version of an installed Python package, or "not installed"."""
    try:
        return version(package_name)
    except PackageNotFoundError:
        return "not installed"


def _test_adapter(adapter: str) -> Options:
    """Render a test frame on an adapter; return whether the adapter works, as entries of the JSON report."""
    from dermis.frame.renderer import Renderer
    from dermis.gpu.textures import float16_store_rounding

    try:
        renderer = Renderer(adapter)
        rounding = renderer.reopening_device.run(lambda: float16_store_rounding(renderer.device))
        test = _render_test_frame(renderer)
    except DermisError as error:
        return {"healthy": False, "used": None, "problem": str(error)}
    adapter_info = {
        "name": renderer.device.adapter.name,
        "backend": renderer.device.adapter.backend,
        "reason": renderer.device.selection_reason,
        "half_store_rounding": rounding,
    }
    problem = None if test["passed"] else "the brightness of the test frame is wrong"
    return {"healthy": test["passed"], "used": adapter_info, "self_test": test, "problem": problem}


def _render_test_frame(renderer: Renderer) -> Options:
    """Render a white sphere lit from the camera, and return the entries of the JSON report on this test.

    The entry "passed" tells whether the sphere's brightness is right.

    The centre must have radiance 1, which is the irradiance over pi, and no pixel may be brighter.
    """
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


def _report_lines(report: Options) -> list[str]:
    lines = ["adapters:"]
    for adapter in report["adapters"]:
        features = ", ".join(f"{name} {'yes' if has else 'no'}" for name, has in adapter["features"].items())
        name = f"{adapter['name']}, {adapter['backend']} ({adapter['kind']})"
        lines.append(f"  #{adapter['number']} {name}: {features}")
    if used := report["used"]:
        test = report["self_test"]
        lines.append(f"used: {used['name']}, {used['backend']}, because {used['reason']}")
        lines.append(f"half-float stores round: {used['half_store_rounding']}")
        result = "passed" if test["passed"] else "FAILED"
        lines.append(f"test frame: {result} in {test['frame_ms']:.0f} ms, centre {test['centre']:.3f} of 1")
    if advice := report.get("drivers"):
        lines += ["graphics drivers:", *(f"  {system}: {action}" for system, action in advice.items())]
    libraries = ", ".join(f"{name} {version}" for name, version in report["libraries"].items())
    lines.append(f"python {report['python']} on {report['platform']}; {libraries}")
    state = {True: "available", False: "not downloaded"}
    samples = ", ".join(f"{name} {state[is_cached]}" for name, is_cached in report["samples"].items())
    lines += [f"cache: {report['cache']}", f"samples: {samples}"]
    return [*lines, "healthy" if report["healthy"] else f"NOT healthy: {report['problem']}"]
