"""Cells of an atlas between which light passes through thin parts: ears, nostrils, lips and eyelids."""
