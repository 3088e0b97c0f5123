"""Settings of planners on the command line: the fields of their dataclasses, angles in degrees."""

import dataclasses
import math
from pathlib import Path
from typing import Literal

import pytest

import fiberplan.planners.protocol as protocol
from fiberplan.cli.app import run
from fiberplan.cli.planner import chosen_planner, settings_facts
from fiberplan.cli.settings import settings_of, shown
from fiberplan.errors import FiberplanError
from fiberplan.planners import PLANNERS
from fiberplan.planners.protocol import setting

pytestmark = pytest.mark.small

OURS = list(PLANNERS)
UNITS = {"", "s", "mm", "deg", "1/mm^2", "rad/s mm^2"}


def another(setting):
    """A value that is not the default, in the unit of the command line, and that every planner takes."""
    if setting.choices:
        return next(choice for choice in setting.choices if choice != setting.default)
    if setting.kind is bool:
        return not setting.default
    if setting.kind is tuple:
        return tuple(part + 1 for part in setting.default)
    if setting.kind is int:
        return setting.default + 1
    return 7.0 if setting.default is None else setting.default * 0.9


def differing(name, key, value):
    return dataclasses.replace(PLANNERS[name](seed=3), **{key: value})


@pytest.mark.parametrize("name", OURS)
def test_every_setting_is_that_of_the_field(name, tmp_path):
    settings = settings_of(PLANNERS[name])
    assert set(settings) == {field.name for field in dataclasses.fields(PLANNERS[name])} - {"seed"}
    assert chosen_planner(name, 3) == PLANNERS[name](seed=3)
    for key, known in settings.items():
        assert known.help
        assert known.unit in UNITS
        assert known.kind is not object
        value = another(known)
        inside = math.radians(value) if known.unit == "deg" else value
        planner = chosen_planner(name, 3, [f"{key}={shown(value)}"])
        assert getattr(planner, key) == (pytest.approx(inside, rel=1e-11) if known.kind is float else inside)
        assert planner == differing(name, key, getattr(planner, key))  # nothing else
        assert settings_facts(planner)[key] == (pytest.approx(value, rel=1e-11) if known.kind is float else value)

        file = tmp_path / f"{key}.toml"
        listed = list(value) if isinstance(value, tuple) else value
        file.write_text(f"{key} = {shown(listed) if not isinstance(listed, list | str) else repr(listed)}\n")
        assert chosen_planner(name, 3, file=file) == planner
        assert chosen_planner(name, 3, [f"{key}={shown(known.default)}"], file) == PLANNERS[name](seed=3)


def test_none_is_a_value_where_the_field_allows_it():
    assert chosen_planner("direct", 0, ["max_time=none"]).max_time is None
    with pytest.raises(FiberplanError, match=r"^--set turn=none: expected a number \[deg\]$"):
        chosen_planner("direct", 0, ["turn=none"])


@pytest.mark.parametrize(
    ("name", "assignment", "words"),
    [
        ("greedy-fold", "stepp=1", "planner greedy-fold has no setting 'stepp'; did you mean 'step'?"),
        ("greedy-fold", "max-travel=1", "did you mean 'max_travel'?"),
        ("greedy-fold", "zzz=1", "it has step, max_travel, skip_noops, relief"),
        ("direct", "step=1", "planner direct has no setting 'step'; greedy-fold has"),
        ("direct", "dt=1", "; navigation-function and elliptic-navigation-function and prioritized-roadmap have"),
        ("direct", "seed=1", "the seed is given by --seed, not as a setting"),
        ("direct", "turn", "--set turn: expected key=value; `fiberplan planners direct` lists the keys"),
        ("direct", "=6", "expected key=value"),
        ("direct", "turn=wide", "--set turn=wide: expected a number [deg]"),
        ("direct", "turn=1_0", "--set turn=1_0: expected a number [deg]"),
        ("direct", "max_time=soon", "--set max_time=soon: expected a number [s], or none"),
        ("greedy-fold", "skip_noops=yes", "--set skip_noops=yes: expected true or false"),
        ("greedy-fold", "relief=joints", "--set relief=joints: expected one of joint, reverse, replace, none"),
        ("prioritized-roadmap", "edges=2.5", "--set edges=2.5: expected a whole number"),
        ("prioritized-roadmap", f"edges={10**25}", "expected a whole number"),
        ("prioritized-roadmap", "grid=8", "--set grid=8: expected 2 values such as 8x6"),
        ("prioritized-roadmap", "grid=8xy", "--set grid=8xy: expected 2 values such as 8x6"),
    ],
)
def test_what_does_not_fit_is_one_line(name, assignment, words):
    with pytest.raises(FiberplanError) as caught:
        chosen_planner(name, 0, [assignment])
    assert words in str(caught.value)


def test_given_twice_is_refused():
    with pytest.raises(FiberplanError, match="--set turn is given twice: 3 and 4"):
        chosen_planner("direct", 0, ["turn=3", "turn=4"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("turn = '6'", "turn=6: expected a number [deg]"),
        ("turn = true", "turn=true: expected a number [deg]"),
        ("turn = 1\nturn = 2", "is not valid TOML"),
        ("turn = ", "is not valid TOML"),
        ("turns = 6", "planner direct has no setting 'turns'; did you mean 'turn'?"),
        ("[direct]\nturn = 6", "planner direct has no setting 'direct'"),
        ("x = " + "[" * 9999, "is not valid TOML"),
        ("turn = 6 \xff", "is not a text file"),
    ],
)
def test_a_file_that_does_not_fit_is_one_line(tmp_path, text, words):
    file = tmp_path / "mine.toml"
    file.write_bytes(text.encode("latin-1"))
    with pytest.raises(FiberplanError) as caught:
        chosen_planner("direct", 0, file=file)
    assert str(caught.value).startswith(f"{file}: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@dataclasses.dataclass(frozen=True)
class Bare:
    """A planner of another package, with and without help, and without a seed."""

    pace: float = 2.0
    turn: float = setting(math.radians(10), "a turn", "rad")
    sure: bool = True
    where: Path = Path()
    kind: Literal[1, 2] = 1
    name = "bare"
    reference = "nobody"

    def __post_init__(self):
        if self.pace > 9:
            raise ValueError("too fast")


def unannotated():
    """A planner whose annotations cannot be resolved."""
    made = dataclasses.make_dataclass("Loose", [("pace", "NoSuchType", 2.0), ("many", "NoSuchType", 3)], frozen=True)
    made.name = made.reference = "loose"
    return made


@pytest.fixture
def others(monkeypatch):
    registry = type(PLANNERS)("planner", "fiberplan.nothing")
    registry.register("bare")(Bare)
    registry.register("loose")(unannotated())
    registry.register("function")(lambda: Bare())
    for module in ("planner", "settings"):
        monkeypatch.setattr(f"fiberplan.cli.{module}.PLANNERS", registry)
    monkeypatch.setattr("fiberplan.planners.PLANNERS", registry)


def test_planners_of_others_have_settings_too(others, capsys):
    chosen = chosen_planner("bare", 0, ["pace=3", "turn=90", "sure=false"])
    assert (chosen.pace, chosen.turn, chosen.sure) == (3.0, pytest.approx(math.pi / 2), False)
    loose = chosen_planner("loose", 0, ["pace=1.5", "many=4"])
    assert (loose.pace, loose.many) == (1.5, 4)
    assert chosen_planner("function", 0) == Bare()
    for name, seed, assignments, words in (
        ("bare", 1, (), "planner bare chooses nothing at random, so it takes no --seed"),
        ("bare", 0, ["pace=10"], "planner bare: too fast"),
        ("function", 0, ["pace=1"], "planner function has no setting 'pace'; it has none"),
    ):
        with pytest.raises(FiberplanError) as caught:
            chosen_planner(name, seed, assignments)
        assert str(caught.value) == words
    assert run(["planners"]) == 0
    assert run(["planners", "bare"]) == 0
    out = capsys.readouterr().out
    assert "A planner of another package" in out
    assert "a turn" in out
    assert "Loose(" not in out


def test_setting_is_a_field_with_its_default():
    field = protocol.setting(2.0, "pace of a walk", "mm")
    assert (field.default, dict(field.metadata)) == (2.0, {"help": "pace of a walk", "unit": "mm"})
