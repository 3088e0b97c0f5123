"""The names that users have, what objects say of themselves, and tables in and out."""

import importlib.util
import logging
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from astropy import units as u
from astropy.table import MaskedColumn, QTable, Table
from astropy.utils.masked import Masked
from numba.core import event

import fiberplan as fp
from fiberplan.errors import PlanError, TargetError, TrajectoryError
from fiberplan.scenes.clustered import clustered_targets
from fiberplan.shaping import quantize

pytestmark = pytest.mark.small

ROOT = Path(__file__).parents[1]


def test_documented_names_are_the_public_ones():
    page = (ROOT / "docs" / "api.md").read_text()
    assert sorted(re.findall(r"^\| `fp\.(\w+)` \|", page, re.MULTILINE)) == sorted(fp.__all__)
    assert dir(fp) == sorted([*fp.__all__, "__version__"])
    for package in ("planners", "shaping", "scenes", "instruments", "io", "hardware", "survey"):
        (line,) = re.findall(rf"^\| `fp\.{package}` \| (.*) \|$", page, re.MULTILINE)
        for name in re.findall(r"`(\w+)`", line):
            assert hasattr(getattr(fp, package), name), name


def test_errors_are_all_public():
    errors = [name for name, thing in vars(sys.modules["fiberplan.errors"]).items() if isinstance(thing, type)]
    assert {*errors} - {"UnknownPositionerError"} <= set(fp.__all__)


@pytest.mark.large
def test_typed_example_runs(tmp_path):
    """`make check` has it checked strictly."""
    example = Path(__file__).with_name("typed_example.py")
    spec = importlib.util.spec_from_file_location("typed_example", example)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    lines = module.told(module.planned(0.5), tmp_path)
    assert "safe: True" in lines[2]


def test_every_repr_is_short(small_plan):
    plane = small_plan.problem.plane
    long = plane.replace(name="x" * 500)
    big = fp.FocalPlane.load("hexagonal")
    things = [
        small_plan, plane, long, big, small_plan.problem, small_plan.trajectory, small_plan.certificate,
        small_plan["R0C1"],
        fp.Problem(long, long.folded, long.folded), plane.bodies[0], fp.diagnose(small_plan),
        fp.Body([[0.0, 0.0]], 1.0, name="y" * 500), fp.Obstacle("z" * 500, [[0.0, 0.0]]), clustered_targets(big, 1),
        fp.FocalPlane.load("miradas").kinematics, quantize(small_plan.trajectory, 4, plane=plane)[1],
    ]  # fmt: skip
    for thing in things:
        assert len(repr(thing)) < 200
        assert "\n" not in repr(thing)
        assert repr(thing).startswith(f"<{type(thing).__name__}")
    assert repr(big) == "<FocalPlane 'hexagonal': 331 positioners, 1 body, 0 obstacles>"
    assert "5 of 6 arrived" not in repr(small_plan)
    assert "4 of 6 arrived" in repr(small_plan)


def test_plan_by_positioner(small_plan):
    part = small_plan["R-1C2"]
    assert (part.id, part.index, part.outcome, part.priority) == ("R-1C2", 1, fp.Outcome.DROPPED, 2.0)
    assert np.isnan(part.goal).all()
    assert np.array_equal(part.requested, small_plan.problem.requested[1])
    assert part.cause.startswith("out of reach: positioner 'R-1C2': alpha")
    assert part.blockers == ("R-1C1", "obstacle 0")
    arrived = small_plan[np.int64(0)]
    assert (arrived.cause, arrived.blockers, arrived.times.tolist()) == ("", (), [0.0, 1.0])
    assert np.array_equal(arrived.angles, [arrived.start, arrived.goal])
    assert np.array_equal(arrived.end, arrived.goal)
    assert [part.id for part in small_plan] == list(small_plan.problem.plane.ids)


@pytest.mark.parametrize(
    ("key", "complaint"),
    [
        ("R0c1", "hexagonal has no positioner 'R0c1'; did you mean 'R0C1'?"),
        (7, "hexagonal has no positioner 7: indices run from 0 to 6"),
        (-1, "hexagonal has no positioner -1: indices run from 0 to 6"),
        (1.5, "a positioner has an id and an index, and is not 1.5"),
    ],
)
def test_a_positioner_that_is_not_there(small_plan, key, complaint):
    with pytest.raises(PlanError) as caught:
        small_plan[key]
    assert str(caught.value) == complaint
    assert isinstance(caught.value, KeyError)


def test_plan_as_table(small_plan):
    table = small_plan.to_table()
    assert isinstance(table, QTable)
    assert list(table["positioner"]) == list(small_plan.problem.plane.ids)
    assert list(table["outcome"]) == [outcome.name for outcome in small_plan.outcomes]
    for name, values in (
        ("start", small_plan.problem.start),
        ("goal", small_plan.problem.requested),
        ("end", small_plan.trajectory.end),
    ):
        angles = np.stack([table[f"{name}_{joint}"].to_value(u.rad) for joint in ("alpha", "beta")], axis=1)
        assert angles == pytest.approx(values, nan_ok=True)
    assert table["blockers"][1] == "R-1C1, obstacle 0"
    assert table["priority"][2] == 3.0
    assert table.meta["planner"] == "greedy-fold"


def test_summary_says_what_was_lost_and_what_is_proven(small_plan):
    lines = small_plan.summary().splitlines()
    assert lines[0] == f"hexagonal, planned by greedy-fold: {small_plan}"
    assert lines[1].startswith("makespan 1 s, lower bound ")
    heads = [line for line in lines if not line.startswith(" ")]
    assert "dropped: 1 of priority 2 in all" in heads
    assert "offline: 1 of priority 7 in all" in heads
    assert heads.index("offline: 1 of priority 7 in all") < heads.index("dropped: 1 of priority 2 in all")
    assert lines[-1] == str(small_plan.certificate)


def test_trajectory_as_table(small_plan):
    motion, ids = small_plan.trajectory, small_plan.problem.plane.ids
    table = motion.to_table(ids)
    assert list(table["positioner"][:3]) == [ids[0], ids[0], ids[1]]
    assert table["time"].unit == u.s
    assert table["beta"].to_value(u.rad) == pytest.approx(motion.angles[:, 1])
    assert list(motion.to_table()["positioner"]) == motion.owner.tolist()
    with pytest.raises(TrajectoryError, match="2 ids for 7 positioners"):
        motion.to_table(["a", "b"])


def assert_same_targets(given, again):
    for name in ("x", "y", "angles", "priority", "parity", "base", "idle"):
        value = getattr(given, name)
        assert (value is None) == (getattr(again, name) is None), name
        assert value is None or np.array_equal(value, getattr(again, name), equal_nan=True), name
    for name in ("positioner", "fiber", "offline"):
        assert getattr(given, name) == getattr(again, name), name


TARGETS = {
    "clustered": lambda: clustered_targets(fp.FocalPlane.hexagonal(1, 22.4), 3),
    "all columns": lambda: fp.Targets(
        [np.nan, 1 / 3], [np.nan, 2.0], ("a, b", 'c"d'), [0.1, 2.0], ("", "metrology"), [1, -1],
        [[0.1, 1 / 7], [np.nan, np.nan]],
    ),
    "by place": lambda: fp.Targets([1.0], [2.0], base=[[1 / 3, 4.0]]),
}  # fmt: skip
WITH_IDLE = {
    "idle": lambda: fp.Targets([1.0], [2.0], base=[[3.0, 4.0]], idle=[[1 / 3, 6.0]], notes=("from a test",)),
    "offline": lambda: fp.Targets([1.0], [2.0], ("a",), offline=("b", "c")),
}


@pytest.mark.parametrize("suffix", ["ecsv", "csv", "fits", "txt"])
@pytest.mark.parametrize("case", TARGETS)
def test_written_targets_read_back_the_same(case, suffix, tmp_path):
    given, path = TARGETS[case](), tmp_path / f"targets.{suffix}"
    given.write(path)
    assert_same_targets(given, fp.Targets.read(path))
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("case", WITH_IDLE)
def test_only_ecsv_says_who_has_no_target(case, tmp_path):
    given, path = WITH_IDLE[case](), tmp_path / "targets.ecsv"
    given.write(path)
    again = fp.Targets.read(path)
    assert_same_targets(given, again)
    assert again.notes == given.notes
    with pytest.raises(TargetError, match=r"targets.csv: only .ecsv, .txt, .dat can say which"):
        given.write(tmp_path / "targets.csv")
    assert not (tmp_path / "targets.csv").exists()


@pytest.mark.parametrize("case", {**TARGETS, **WITH_IDLE})
def test_tables_of_targets_are_taken_as_given(case):
    given = {**TARGETS, **WITH_IDLE}[case]()
    assert_same_targets(given, fp.Targets.from_table(given.to_table()))


def test_targets_that_cannot_be_written(tmp_path):
    given = TARGETS["clustered"]()
    with pytest.raises(TargetError, match=r"targets.unknown: cannot be written as a table"):
        given.write(tmp_path / "targets.unknown")
    with pytest.raises(TargetError, match="cannot be written"):
        given.write(tmp_path / "no folder" / "targets.ecsv")
    assert list(tmp_path.iterdir()) == []


def masked_table(kind):
    x = [1.0, 2.0, 3.0]
    mask = [False, True, False]
    column = MaskedColumn(x, unit="cm", mask=mask) if kind is Table else Masked(x * u.cm, mask=mask)
    return kind({"positioner": ["a", "b", "c"], "x": column, "y": [1.0, 2.0, 3.0] * u.mm})


@pytest.mark.parametrize("kind", [Table, QTable])
def test_masked_rows_are_refused_or_left_out_by_name(kind):
    with pytest.raises(TargetError, match="table: row 2: x is empty"):
        fp.Targets.from_table(masked_table(kind))
    kept = fp.Targets.from_table(masked_table(kind), masked="drop")
    assert kept.positioner == ("a", "c")
    assert kept.x.tolist() == [10.0, 30.0]
    assert kept.rows == ("row 1", "row 3")
    assert kept.notes == ("row 2 of the table was left out: x of positioner 'b' is masked",)


def test_masked_cells_that_nobody_needs_are_left_out():
    angles = MaskedColumn([0.0, 100.0], unit="deg", mask=[True, False])
    table = Table({"x": MaskedColumn([1.0, 2.0], mask=[False, True]), "y": [1.0, 2.0], "alpha": angles, "beta": angles})
    kept = fp.Targets.from_table(table, masked="drop")
    assert len(kept) == 2
    assert kept.commanded.tolist() == [False, True]
    assert kept.notes == ()


def test_from_table_refuses_what_is_no_table_of_targets():
    for table, masked, complaint in (
        ({"x": [1.0]}, "raise", "expected a table of astropy, got dict"),
        (Table({"x": [1.0]}), "raise", "table: no column 'y'"),
        (Table({"x": [1.0] * u.deg, "y": [1.0]}), "raise", "column 'x': unit 'deg' is not a length"),
        (Table({"x": [1.0], "y": [1.0]}), "keep", "masked must be 'raise' or 'drop', got 'keep'"),
        (Table({"x": [1.0], "y": [1.0]}, meta={"fiberplan": {"idle": "no"}}), "raise", "meta data"),
    ):
        with pytest.raises(TargetError, match=complaint):
            fp.Targets.from_table(table, masked)


def test_logging_is_quiet_unless_asked():
    logger = logging.getLogger("fiberplan")
    assert [type(handler) for handler in logger.handlers] == [logging.NullHandler]
    assert logger.level == logging.NOTSET


def test_kernels_being_compiled_are_told(caplog, capsys):
    with caplog.at_level(logging.DEBUG, "fiberplan"):
        for function in (fp.verify, np.sum):
            with event.trigger_event("numba:compile", data={"dispatcher": SimpleNamespace(py_func=function)}):
                pass
    assert [(record.name, record.levelname) for record in caplog.records] == [("fiberplan.kernels.compile", "DEBUG")]
    assert caplog.messages == ["compiling verify of fiberplan.certificates.safety"]
    assert capsys.readouterr() == ("", "")
