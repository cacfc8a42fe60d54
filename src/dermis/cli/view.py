"""`dermis view`: a head to turn in one's hands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from dermis.cli.console import note, print_lines, working_on
from dermis.cli.options import Whole, check, parse_size
from dermis.errors import refuse

if TYPE_CHECKING:
    from dermis.viewer.state import ViewerState

_HOST, _PORT = "127.0.0.1", 8765
_SOFTWARE_ATLAS = 1024  # a still frame of the usual one takes a processor several seconds


def view(
    head: str = "bust",
    /,
    *,
    browser: bool = False,
    port: Whole = None,
    host: str | None = None,
    token: Annotated[bool, Parameter(negative="")] = False,
    size: str = "1280x800",
    atlas: Whole = None,
    samples: Whole = None,
    lights: str | None = None,
    env: str | None = None,
    camera: str | None = None,
    profile: str | None = None,
    adapter: str = "auto",
) -> int:
    """Turn a head, its skin and its light in a window or in a web page.

    Drag to turn, right drag to pan, wheel to come nearer, double click to turn around a place, Shift and
    drag to carry the light. Keys 1 to 5 are the camera presets, Tab hides the panel, ? shows all keys, Ctrl+Z
    and Ctrl+Y undo and redo. The panel saves the scene as a TOML file that `dermis render` takes.

    Examples
    --------
        dermis view lee_perry_smith --env royal_esplanade

        dermis view scene.toml --browser --port 8080

    Parameters
    ----------
    head:
        The built-in bust, a sample, a mesh file, or a scene in TOML.
    browser:
        Serve a web page instead of opening a window, for machines without a screen.
    port:
        Where the page is served; 0 for any that is free [8765].
    host:
        Address to listen at; others than this machine's own need the token in the printed URL [127.0.0.1].
    token:
        Ask for a token in the URL on this machine too: for one with other users, and behind a proxy.
    size:
        WIDTHxHEIGHT of the window [1280x800].
    atlas:
        Side of the irradiance map [2048, and 1024 on a software adapter].
    samples:
        Samples of each pixel of a still picture [4].
    lights:
        A rig (studio, window, top, rim, rembrandt, laser, none) or a TOML file with [[lights]].
    env:
        Light from all around: royal_esplanade, lebombo, uniform, or a latitude-longitude .hdr or .exr file.
    camera:
        portrait, three-quarter, profile, ear, cheek, or a TOML file with [camera].
    profile:
        Diffusion profile: a preset or a file.
    adapter:
        auto (the best), cpu (software), or a part of an adapter's name.
    """
    given = {name: value for name, value in locals().items() if value is not None and value is not False}
    if not browser:
        for name in ("port", "host", "token"):
            if name in given:
                refuse(f"--{name}", "a web page with it", "there is none", "Add --browser")
    _check_port(port)
    window = parse_size(size)
    from dermis.viewer.windows import serve, show_window

    with working_on("loading"):
        state = _state(head, given, adapter)
    if browser:
        where = host or _HOST, _PORT if port is None else port
        serve(state, adapter, window, *where, _announce, secret=token)
    else:
        show_window(state, adapter, window)
    return 0


def _check_port(port: int | None) -> None:
    if port is not None and not 0 <= port < 1 << 16:
        refuse("--port", "a number from 0 to 65535", f"{port} came", "Choose another")


def _state(head: str, given: dict[str, Any], adapter: str) -> ViewerState:
    """The scene that the options describe."""
    from dermis.cli.render_scene import assemble
    from dermis.gpu.adapters import fitting_adapters
    from dermis.scene import Settings
    from dermis.scene.files import head_table
    from dermis.viewer.state import opened

    is_scene = Path(head).suffix.lower() == ".toml"
    check(Settings, {name: given[name] for name in ("atlas", "samples") if name in given})
    taken = ("atlas", "samples", "lights", "env", "camera", "profile")
    scene, settings = assemble(head, {name: given[name] for name in taken if name in given})
    if "atlas" not in given and not is_scene and fitting_adapters(adapter)[0][0].kind == "CPU":
        settings = settings.model_copy(update={"atlas": _SOFTWARE_ATLAS})
    name = str(Path(head).resolve()) if Path(head).is_file() else head
    table = head_table(Path(head)) if is_scene else {"name": name}
    rig = given.get("lights", "" if is_scene else "none" if "env" in given else "studio")
    return opened(scene, settings, table, rig)


def _announce(url: str, exposed: bool) -> None:
    if exposed:
        note("warning: other machines can reach this page; who knows its address controls the viewer")
        note("warning: the connection is not encrypted: use it in a network that you trust, or a tunnel")
    print_lines(f"{url}  (Ctrl+C ends it)")
