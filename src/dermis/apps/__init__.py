"""Applications built on the renderer: data sets, exports, validation, the gallery and viewers."""
