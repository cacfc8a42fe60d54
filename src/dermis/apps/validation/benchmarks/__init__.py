"""Frame times on this machine, stage by stage, compared with the limit by memory bandwidth."""
