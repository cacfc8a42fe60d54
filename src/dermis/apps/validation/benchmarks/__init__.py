"""Benchmark of frame times by stage on this machine, compared with limits set by memory bandwidth."""
