"""Everything of the viewer but its window: what keys, pointers and the panel work on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from dermis.errors import refuse
from dermis.viewer.controls import Controls
from dermis.viewer.history import History
from dermis.viewer.split import Split
from dermis.viewer.state import PARTS, PICTURE, ViewerState, load_state, save_state
from dermis.viewer.studio import Studio


@dataclass
class Messages:
    """What is written over the picture: the adapter's own line, and what went wrong or right last."""

    status: str = ""
    said: str = ""


@dataclass
class Names:
    """Files that the panel's buttons write, and the size of screenshots [pixel]."""

    scene: str = "scene.toml"
    picture: str = "dermis.png"
    size: tuple[int, int] = (1920, 1080)


class Desk:
    """A history of states, the hands that change them, and the studio that draws them.

    split : what is compared with, and where its edge is
    places : where the panel's controls are in the window, by their labels
    """

    def __init__(self, state: ViewerState, studio: Studio) -> None:
        self.history = History(state)
        self.controls = Controls(self.history)
        self.studio = studio
        self.split = Split()
        self.messages = Messages()
        self.names = Names()
        self.places: dict[str, tuple[float, float]] = {}

    @property
    def state(self) -> ViewerState:
        """Of now."""
        return self.history.state

    def change(self, state: ViewerState, gesture: str = "") -> None:
        """Go on to a state; changes of one gesture are undone at once."""
        self.history.change(state, gesture)
        self.messages.said = ""

    def save(self, path: Path) -> None:
        """Write the scene.

        Raises DermisError when that is not possible.
        """
        save_state(path, self.state)
        self.messages.said = f"saved {path}"

    def load(self, path: Path) -> None:
        """Go on to the scene of a file.

        Raises DermisError for a file that is no scene.
        """
        self.change(load_state(path, self.state))
        self.messages.said = f"loaded {path}"

    def screenshot(self, path: Path, size: tuple[int, int]) -> None:
        """Write the picture at a size, as .png with the tone curve or as .exr, linear.

        Raises DermisError when that is not possible.
        """
        kind, view = path.suffix.lower(), self.state.view
        if kind not in (".png", ".exr"):
            refuse(f"picture {path}", "a name that ends in .png or .exr", f"{path.name!r} came", "Change it")
        if kind == ".exr" and view not in (PICTURE, *PARTS):
            refuse(f"view {view} as .exr", "a view of linear light", "its numbers are colours", "Take .png")
        self.studio.screenshot(path, self.state, size)
        self.messages.said = f"wrote {path}, {size[0]} x {size[1]}"
