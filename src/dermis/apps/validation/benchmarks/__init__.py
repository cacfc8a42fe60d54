"""How fast the frame is on this machine, stage by stage, compared with what its memory allows."""
