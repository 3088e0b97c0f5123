"""``python -m fiberplan``: the command line."""

from fiberplan.cli import main

main()
