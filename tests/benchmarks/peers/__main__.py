"""Run `comparison`, which says how."""

from comparison import main

main()
