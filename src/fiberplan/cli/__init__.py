"""The command line: parses, calls, prints; no logic of its own.

Commands speak degrees, millimetres and seconds, and answer programs in JSON (`answers`). Exit codes: 0 done, 1 the
answer is no, 2 bad input (one line on stderr, nothing written), 130 interrupted, 143 terminated.
"""

import gc
import sys

from fiberplan.errors import interrupted

__all__ = ["main"]


def main() -> None:
    """The ``fiberplan`` command."""
    gc.set_threshold(20_000)  # imports make no garbage, and looking for it takes a tenth of a short command
    try:
        from fiberplan.cli.app import main as command
    except BaseException as error:  # Ctrl-C while the commands are imported
        if not interrupted(error):
            raise
        print("fiberplan: error: interrupted", file=sys.stderr)
        sys.exit(130)
    command()
