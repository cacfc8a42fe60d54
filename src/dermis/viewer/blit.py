"""The rendered image into the window's texture, without a detour through main memory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dermis.gpu import Device
from dermis.gpu.program import Program


class Blit(Program):
    """Draws an image of bytes over a whole target of one format."""

    def __init__(self, device: Device, target: str) -> None:
        super().__init__(device, Path(__file__).parent / "blit.wgsl")
        fragment = {
            "module": self._module,
            "entry_point": "fragment",
            "constants": {"DECODED": target.endswith("-srgb")},
            "targets": [{"format": target}],
        }
        self._pipeline = device.handle.create_render_pipeline(
            layout=self._layout,
            vertex={"module": self._module, "entry_point": "vertex"},
            fragment=fragment,
            primitive={"topology": "triangle-list", "cull_mode": "none"},
        )

    def draw(self, image: Any, view: Any) -> None:
        """Scale the image to the size of the target.

        image : texture of sRGB bytes
        view : of the target's texture
        """
        handle = self.device.handle
        entry = {"binding": 0, "resource": image.create_view()}
        group = handle.create_bind_group(layout=self._layouts[0], entries=[entry])
        encoder = handle.create_command_encoder()
        whole = {"view": view, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
        one = encoder.begin_render_pass(label="blit", color_attachments=[whole])
        one.set_pipeline(self._pipeline)
        one.set_bind_group(0, group)
        one.draw(3)
        one.end()
        handle.queue.submit([encoder.finish()])

    def _visibility(self) -> int:
        import wgpu

        return int(wgpu.ShaderStage.VERTEX | wgpu.ShaderStage.FRAGMENT)
