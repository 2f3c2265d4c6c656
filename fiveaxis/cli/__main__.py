"""`python -m fiveaxis.cli` is the command `fiveaxis`."""

from fiveaxis.cli import main

main()
