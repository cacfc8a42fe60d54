"""Outputs of a frame besides its picture, and the readback of the picture and the outputs."""

from dermis.frame.features.outputs.labels import shader_constants
from dermis.frame.features.outputs.resources import Resources, make_resources
from dermis.frame.features.outputs.stages import draw, hair_label_bindings, shader_lists

__all__ = ["Resources", "draw", "hair_label_bindings", "make_resources", "shader_constants", "shader_lists"]
