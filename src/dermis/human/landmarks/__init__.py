"""Landmarks of published sets on the parametric human, and of users' tables on any mesh."""
