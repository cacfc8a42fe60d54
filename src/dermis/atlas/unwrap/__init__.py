"""Uv layouts: a mesh cut into charts, each laid flat with little stretch, all packed into one map."""
