"""Meshes and heads: geometry, rigs, poses, eyeballs, hair strands and subdivision."""
