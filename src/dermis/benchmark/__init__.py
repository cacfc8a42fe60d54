"""How fast the frame is on this machine, stage by stage, beside what its memory would allow."""
