"""Command line program: `python -m dermis`."""

from dermis.cli import main

main()
