"""Heads as geometry: polygons, rigs and poses, eyes, hairs, and the maps that come with them."""
