"""Motion of hair over the frames of an animation."""

from __future__ import annotations

from typing import NamedTuple

from dermis.base.errors import refuse
from dermis.base.quantities import checked_number
from dermis.frame.features.hair.swing import SwingBuffers
from dermis.gpu import Buffer, Device
from dermis.scene.model import Scene

MAX_FRAMES_PER_S = 1000.0
"""Largest frame rate of a motion of hair [1/s]."""


class HairFrame(NamedTuple):
    """Frame of an animation in which hair swings.

    motion : motion of the hair
    frame_index : index of the frame
    """

    motion: HairMotion
    frame_index: int


class HairMotion:
    """Swing of long hair over the frames of one animation, by a simulation of its guides on the device.

    Hair is at rest in the first frame. Each further frame advances the simulation by its time, in equal
    substeps of at most 1/240 s, or 60 longer ones below 4 frames per second. Frames depend only on the poses,
    not on which of them are rendered, or when. Heads without scalp hair and beard are rendered as without it.

    Parameters
    ----------
    frames_per_s : float
        Frame rate of the animation, above 0 to 1000 [1/s].

    Raises
    ------
    DermisError
        For a frame rate out of range.

    Examples
    --------
    >>> import dermis
    >>> motion = dermis.HairMotion(30)
    >>> motion.frame_count
    0
    """

    def __init__(self, frames_per_s: float = 30.0) -> None:
        rate = checked_number("frames_per_s", frames_per_s, 0.0, MAX_FRAMES_PER_S)
        if rate == 0.0:
            refuse("frames_per_s", "a frame rate above 0", "got 0", "Pass frames per second, such as 30")
        self.seconds_per_frame = 1.0 / rate
        self._scenes: list[Scene] = []
        self._buffers: SwingBuffers | None = None
        self._done = -1  # index of the frame up to which the buffers are simulated

    @property
    def frame_count(self) -> int:
        """Return the number of frames so far."""
        return len(self._scenes)

    def advance(self, scene: Scene) -> HairFrame:
        """Add a frame, and return it for `Renderer.draw`.

        A frame need not be rendered; later frames take its pose into account.

        Parameters
        ----------
        scene : Scene
            Scene of the frame; all scenes show the same head.

        Returns
        -------
        HairFrame
            The added frame.
        """
        self._scenes.append(scene)
        return HairFrame(self, len(self._scenes) - 1)

    def scene(self, index: int) -> Scene:
        """Return the scene of a frame."""
        return self._scenes[index]

    def buffers(self, device: Device, guides: Buffer) -> SwingBuffers | None:
        """Return the buffers of the simulation; None before its first step, and for another device or size.

        guides : buffer of the guides of the hair style, to which the size of the buffers must fit
        """
        found = self._buffers
        usable = found is not None and found.device is device and found.guides.size == guides.size
        return found if usable else None

    def missing_frames(self, buffers: SwingBuffers, index: int) -> range:
        """Return the indices of the frames to simulate up to a frame, which is the last of them.

        The step of the latest frame can be repeated; an earlier frame is simulated from the start.
        """
        if buffers is not self._buffers or self._done > index:
            return range(index + 1)
        return range(min(self._done + 1, index), index + 1)

    def mark_done(self, buffers: SwingBuffers, index: int) -> None:
        """Record that the buffers have been simulated up to a frame."""
        self._buffers, self._done = buffers, index
