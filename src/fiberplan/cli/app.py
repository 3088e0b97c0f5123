"""The commands together, and what every one of them does with an error: one line on stderr and an exit code."""

import sys
import traceback
from collections.abc import Sequence
from typing import Annotated

import typer

from fiberplan import __version__
from fiberplan.cli.demo import demo
from fiberplan.cli.diagnose import diagnose
from fiberplan.cli.examples import examples_of
from fiberplan.cli.export import export
from fiberplan.cli.instruments import instruments
from fiberplan.cli.output import complain, say
from fiberplan.cli.plan import plan
from fiberplan.cli.planners import planners
from fiberplan.cli.removed_options import removed_option
from fiberplan.cli.reproduce import reproduce
from fiberplan.cli.show import show
from fiberplan.cli.verify import verify
from fiberplan.cli.warmup import warmup
from fiberplan.errors import FiberplanError

BAD_INPUT = 2
INTERRUPTED = 130
BUG = 70  # anything but 1, which means that the answer is no

app = typer.Typer(
    name="fiberplan",
    help="Collision-free, proven motion for fiber positioners. Angles in degrees, lengths in mm, times in s.",
    epilog="Exit codes: 0 done; 1 the answer is no (contacts found, targets lost); 2 bad input, nothing written.\n\n"
    + examples_of(""),
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)
for command in (demo, plan, verify, diagnose, show, export, instruments, planners, reproduce, warmup):
    app.command(epilog=examples_of(command.__name__))(command)


def _print_version(wanted: bool) -> None:
    if wanted:
        say(f"fiberplan {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    try:
        code = app(args=list(arguments), prog_name="fiberplan", standalone_mode=False)
    except KeyboardInterrupt:
        code = INTERRUPTED
    except FiberplanError as error:
        complain(str(error))
        return BAD_INPUT
    except OSError as error:
        complain(f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error))
        return BAD_INPUT
    except Exception as error:
        if hasattr(error, "format_message"):  # the parser's own: an unknown option, a value that is no number
            complain(removed_option(error, arguments) or error.format_message())
            return BAD_INPUT
        traceback.print_exc()
        complain("this is a bug in fiberplan; the lines above say where")
        return BUG
    if code == INTERRUPTED:
        complain("interrupted")
    return code if isinstance(code, int) else 0


def main() -> None:
    """The ``fiberplan`` command."""
    sys.exit(run(sys.argv[1:]))
