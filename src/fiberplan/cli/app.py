"""The commands together, and what every one of them does with an error: one line on stderr and an exit code."""

import signal
import sys
import traceback
from collections.abc import Sequence
from types import FrameType
from typing import Annotated, NoReturn

import typer

from fiberplan import __version__
from fiberplan.cli.allocate import allocate
from fiberplan.cli.amend import amend
from fiberplan.cli.animate import animate
from fiberplan.cli.audit import audit
from fiberplan.cli.demo import demo
from fiberplan.cli.diagnose import diagnose
from fiberplan.cli.examples import examples_of
from fiberplan.cli.export import export
from fiberplan.cli.figure import figure
from fiberplan.cli.instruments import instruments
from fiberplan.cli.night import fold, separate, unwind
from fiberplan.cli.output import complain, say
from fiberplan.cli.plan import plan
from fiberplan.cli.planners import planners
from fiberplan.cli.removed_options import removed_option
from fiberplan.cli.replay import replay
from fiberplan.cli.reproduce import reproduce
from fiberplan.cli.show import show
from fiberplan.cli.simulate import simulate
from fiberplan.cli.survey import survey
from fiberplan.cli.verify import verify
from fiberplan.cli.warmup import warmup
from fiberplan.errors import FiberplanError, interrupted

BAD_INPUT = 2
INTERRUPTED = 130
ENDING = (signal.SIGTERM, signal.SIGHUP)  # exit 143 and 129
BUG = 70  # anything but 1, which means that the answer is no

app = typer.Typer(
    name="fiberplan",
    help="Collision-free, proven motion for fiber positioners. Angles in degrees, lengths in mm, times in s.",
    epilog="Exit codes: 0 done; 1 the answer is no (contacts found, targets lost); 2 bad input, nothing written.\n\n"
    + examples_of(""),
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)
NUMBERS = {"ignore_unknown_options": True}  # a negative number is one, and no option
proofs = (verify, replay, diagnose)
motors = (export, audit, simulate)
commands = (demo, allocate, survey, plan, *proofs, show, figure, animate, *motors, amend, separate, fold, unwind)
for command in (*commands, instruments, planners, reproduce, warmup):
    settings = NUMBERS if command is amend else None
    app.command(epilog=examples_of(command.__name__), context_settings=settings)(command)


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
    except Ended as ended:
        complain("terminated")
        return 128 + ended.number
    except (KeyboardInterrupt, Exception) as error:
        return _explained(error, arguments)
    if code == INTERRUPTED:
        complain("interrupted")
    return code if isinstance(code, int) else 0


def _explained(error: BaseException, arguments: Sequence[str]) -> int:
    """Say on stderr what went wrong, and return the exit code for it."""
    if interrupted(error):
        complain("interrupted")
        return INTERRUPTED
    if isinstance(error, OSError):
        complain(f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error))
    elif isinstance(error, FiberplanError):
        complain(str(error))
    elif hasattr(error, "format_message"):  # the parser's own: an unknown option, a value that is no number
        complain(removed_option(error, arguments) or error.format_message().replace(": Value error, ", ": "))
    else:
        traceback.print_exception(error)
        complain("this is a bug in fiberplan; the lines above say where")
        return BUG
    return BAD_INPUT


class Ended(BaseException):
    """A signal asked the command to end: whatever is half done is undone on the way out, as after Ctrl-C.

    It is no interrupt, after which planners return the best that they have.
    """

    def __init__(self, number: int):
        super().__init__(number)
        self.number = number


def _end(number: int, frame: FrameType | None) -> NoReturn:
    for each in ENDING:
        signal.signal(each, signal.SIG_IGN)  # clearing up is not disturbed
    raise Ended(number)


def main() -> None:
    """The ``fiberplan`` command."""
    for each in ENDING:
        if signal.getsignal(each) is signal.SIG_DFL:  # `nohup` has it ignored
            signal.signal(each, _end)
    sys.exit(run(sys.argv[1:]))
