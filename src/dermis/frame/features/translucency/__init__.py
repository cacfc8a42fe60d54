"""Light through thin parts: ears, nostrils, lips, eyelids."""
