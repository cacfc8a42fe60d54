"""Comparison of landmarks of data sets with face detectors that were trained on photographs."""
