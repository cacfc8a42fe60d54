"""Rendering of data sets: pictures of sampled people with ground truth, on one machine or on several."""
