"""Translucency: light through thin parts of the head, such as ears, nostrils, lips and eyelids."""
