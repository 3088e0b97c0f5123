"""The command line: parses, calls, prints; no logic of its own.

Commands speak degrees, millimetres and seconds, and answer programs in JSON (`answers`). Exit codes: 0 done, 1 the
answer is no, 2 bad input (one line on stderr, nothing written), 130 interrupted.
"""

from fiberplan.cli.app import main

__all__ = ["main"]
