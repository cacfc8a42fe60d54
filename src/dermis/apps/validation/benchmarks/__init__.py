"""Benchmark of frame times on this machine by stage, compared with the limit by memory bandwidth."""
