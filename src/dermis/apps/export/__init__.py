"""Skin for other programs: what each of them needs to be told, and how wrong it will be."""
