"""Translucency: light through thin parts such as ears, nostrils, lips and eyelids."""
