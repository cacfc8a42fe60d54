"""Light from all around: panoramas, their sun-like peaks, and what the frame reads of them."""
