"""Facial landmarks: published sets on the parametric human, and tables of vertices for any mesh."""
