"""Dry skin: all light leaves where it entered."""

from dermis.frame.techniques.technique import Technique

TECHNIQUE = Technique()
