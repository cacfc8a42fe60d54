"""Entry point of `python -m dermis`, the command line program."""

from dermis.cli import main

main()
