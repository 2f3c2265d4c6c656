"""Run the command `fiveaxis` as `python -m fiveaxis.cli`."""

from fiveaxis.cli import main

main()
