"""Skin without subsurface scattering: all light leaves where it enters."""

from dermis.frame.techniques.technique import Technique

TECHNIQUE = Technique()
