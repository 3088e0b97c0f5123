"""What one learns a command from: its help, its examples, hints, and what a shell completes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

import fiberplan as fp
from fiberplan.cli.app import app, run
from fiberplan.cli.examples import EXAMPLES

COMMANDS = list(get_command(app).commands)
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(fp.__file__).parents[1]), "COLUMNS": "100"}
ENTRIES = {"module": ["-m", "fiberplan"], "command": ["-c", "from fiberplan.cli import main; main()"]}


def called(*arguments, entry="module", **environment):
    command, variables = [sys.executable, *ENTRIES[entry], *arguments], ENVIRONMENT | environment
    return subprocess.run(command, capture_output=True, text=True, env=variables)


def completed(*words):
    """What bash offers for the last word."""
    asked = {"COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1), "_FIBERPLAN_COMPLETE": "complete_bash"}
    return called(**asked).stdout.split()


def test_help_of_plan_fits_on_a_screen():
    done = called("plan", "--help")
    assert done.returncode == 0
    assert len(done.stdout.rstrip().splitlines()) <= 55  # eight options more than a start, a margin and a planner need
    for option in ("--start", "--planner", "--set", "--settings", "--margin", "--conflicts", "--page", "--json"):
        assert f" {option} " in done.stdout


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_every_help_has_examples(command, capsys, monkeypatch):
    """Whole, a line each, and every line is one that the command takes."""
    monkeypatch.setenv("COLUMNS", "100")
    assert run([command, "--help"] if command else ["--help"]) == 0
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    begin = next(k for k, line in enumerate(lines) if line.strip() == "Examples:")
    shown = [line.strip() for line in lines[begin + 1 :] if line.strip()]
    assert [line.partition(" #")[0].rstrip() for line in shown] == [line for line, _ in EXAMPLES[command]]
    for line, _ in EXAMPLES[command]:
        program, *words = line.split()
        assert program == "fiberplan"
        if command:
            assert words[0] == command
        if words[0] in COMMANDS:
            get_command(app).commands[words[0]].make_context(words[0], words[1:])  # or it raises
            assert all(assignment.count("=") == 1 for assignment in words if assignment.startswith("step"))


@pytest.mark.small
def test_there_are_examples_of_what_there_is():
    assert set(EXAMPLES) == {"", *COMMANDS}


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["planners", "direct"], ["plan", "--no-such"]])
def test_the_module_behaves_as_the_command(arguments):
    one, other = (called(*arguments, entry=entry) for entry in ENTRIES)
    assert (one.returncode, one.stdout, one.stderr) == (other.returncode, other.stdout, other.stderr)
    assert one.returncode == (2 if "--no-such" in arguments else 0)


def test_help_of_a_command_does_not_wait_for_arrays_and_compiler():
    check = "import sys; from fiberplan.cli.app import run; run(['{}', '--help']); sys.exit('numpy' in sys.modules)"
    for command in ("plan", "planners"):
        done = subprocess.run([sys.executable, "-c", check.format(command)], capture_output=True, env=ENVIRONMENT)
        assert done.returncode == 0


@pytest.mark.small
@pytest.mark.parametrize(
    ("given", "hint"),
    [
        (["--step", "1"], "--step is now --set step=1"),
        (["--turn=3"], "--turn is now --set turn=3"),
        (["--D", "9"], "--D is now --set D=9"),
        (["--collision-dt", "-1"], "--collision-dt is now --set collision_dt=-1"),
        (["--max-time"], "--max-time is now --set max_time=VALUE"),
        (["--garages"], "--garages is now --set garages=true"),
        (["--no-garages"], "--no-garages is now --set garages=false"),
        (["--literal"], "--literal is now --set skip_noops=false"),
    ],
)
def test_a_removed_option_says_what_to_type_now(given, hint, capsys):
    assert run(["plan", "sdss", "field.ecsv", *given]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err == f"fiberplan: error: no such option: {hint}\n"


@pytest.mark.small
def test_an_option_that_never_was_has_no_such_hint(capsys):
    assert run(["plan", "sdss", "field.ecsv", "--garage"]) == 2
    assert run(["verify", "plan.fits", "--step", "1"]) == 2
    assert "is now" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("plan", "--planner", "gre"), ["greedy-fold"]),
        (("plan", "--planner", "greedy-fold", "--set", "m"), ["max_travel="]),
        (("plan", "sds"), ["sdss"]),
        (("export", "plan.fits", "--to", "mot"), ["motions"]),
        (("reproduce", "say"), ["sayres2021"]),
        (("verify", "--ma"), ["--margin"]),
    ],
)
def test_a_shell_completes(words, offered):
    assert completed("fiberplan", *words) == offered


def test_completion_can_be_shown():
    done = called("--show-completion", "bash", _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1")
    assert "_FIBERPLAN_COMPLETE=complete_bash" in done.stdout
