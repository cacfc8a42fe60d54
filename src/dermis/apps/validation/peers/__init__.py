"""The frame against Cycles and Mitsuba on one processor: time, noise and error, for docs/peers.md."""
