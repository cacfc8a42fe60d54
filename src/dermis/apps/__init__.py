"""Applications built on the renderer: data sets, exports, validation, galleries and viewers."""
