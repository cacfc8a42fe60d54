"""Rendering of data sets: many pictures with ground truth, on one machine or on several."""
