"""From a photograph of a face to its light and skin."""
