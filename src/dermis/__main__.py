"""`python -m dermis`."""

from dermis.cli import main

main()
