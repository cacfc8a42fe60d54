"""Techniques against the truth: scenes, truths, figures and a report."""
