"""Pictures that explain the technique: each is a script of a few lines, all together are one page."""
