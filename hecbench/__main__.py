"""`python -m hecbench`."""

from hecbench.commands.cli import main

main()
