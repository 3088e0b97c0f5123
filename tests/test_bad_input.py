"""Every mistake of a user that the library is to name: one line with file, row, column and value."""

import numpy as np
import pytest

from fiberplan.errors import FiberplanError, InstrumentError, ProblemError, TargetError
from fiberplan.focal_plane import FocalPlane
from fiberplan.instruments import names
from fiberplan.io.states import read_state
from fiberplan.problem import Problem, Targets
from fiberplan.scenes import clustered_sky, clustered_targets, uniform_field

pytestmark = pytest.mark.small

HEAD = "positioner,x,y\n"
GOOD = "R0C2,10,5\n"


def complaint(error, call):
    """The message of the expected error, after a look at its form."""
    with pytest.raises(error) as caught:
        call()
    text = str(caught.value)
    assert isinstance(caught.value, FiberplanError)
    assert "\n" not in text
    assert caught.value.__cause__ is None
    return text


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "sayers2021",
            f"no instrument 'sayers2021'; did you mean 'sayres2021'? (built in: {', '.join(names())})",
        ),
        ("nowhere/array.toml", "nowhere/array.toml: no such file"),
        ("array.fits", "array.fits: no such file"),
    ],
)
def test_unknown_instrument(name, message):
    assert complaint(InstrumentError, lambda: FocalPlane.load(name)) == message


def test_folders_and_files_that_are_no_instrument(tmp_path):
    wanted = complaint(InstrumentError, lambda: FocalPlane.load(tmp_path))
    assert "the folder is no instrument" in wanted
    assert "a folder of SDSS-V calibrations (with wokCoords.csv)" in wanted
    (tmp_path / "array.txt").write_text("")
    text = complaint(InstrumentError, lambda: FocalPlane.load(tmp_path / "array.txt"))
    assert "the file is no instrument, which is one of: " in text
    assert "a positioners.cfg of MOONS" in text
    (tmp_path / "array.toml").write_bytes(b"\xff\xfe\x00")
    assert "not a text file" in complaint(InstrumentError, lambda: FocalPlane.load(tmp_path / "array.toml"))


def test_truncated_instrument(tmp_path):
    path = tmp_path / "array.fits"
    FocalPlane.load("hexagonal").write(path)
    content = path.read_bytes()
    for part in (0.1, 0.5, 0.97):
        path.write_bytes(content[: int(part * len(content))])
        assert "truncated or damaged" in complaint(InstrumentError, lambda: FocalPlane.load(path))
    path.write_bytes(content[: content.index(b"XTENSION", 20000) // 2880 * 2880])  # cut between two tables
    assert "is damaged" in complaint(InstrumentError, lambda: FocalPlane.load(path))


def test_instrument_to_a_folder_that_is_not_there(tmp_path):
    call = FocalPlane.load("hexagonal").write
    assert "cannot be written" in complaint(InstrumentError, lambda: call(tmp_path / "none" / "array.fits"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("positioner,x\nR0C2,10\n", "no column 'y'; it has 'positioner', 'x'"),
        ("positioner,alpha\nR0C2,10\n", "no column 'beta'"),
        ("positioner,x [furlongs],y\n" + GOOD, "column 'x': unknown unit 'furlongs'"),
        ("# y: deg\n" + HEAD + GOOD, "column 'y': unit 'deg' is not a length"),
        (HEAD + GOOD + "R0C1,nan,5\n", "line 3: x is nan"),
        ("# made by hand\n\n" + HEAD + GOOD + "\nR0C1,5,inf\n", "line 6: y is inf"),
        (HEAD + GOOD + "R0C1,,5\n", "line 3: x is empty"),
        (HEAD + GOOD + "R0C1,5,five\n", "line 3: y is 'five', not a number"),
        (HEAD + GOOD + "R0C2,5,6\n", "line 3: positioner 'R0C2' already has a target in line 2"),
        (HEAD + GOOD + ",5,6\n", "line 3: positioner is empty"),
        (HEAD + GOOD + "R0C1,5\n", "line 3: 2 values for 3 columns"),
        ("positioner,x,x\nR0C2,1,2\n", "line 1: column 'x' appears twice"),
        (HEAD, "the table has no rows"),
        ("", "the file is empty"),
        ("positioner,x,y,priority\nR0C2,10,5,-1\n", "line 2: priority is -1"),
        ("positioner,x,y,parity\nR0C2,10,5,up\n", "line 2: parity is 'up', not a number"),
        ("positioner,x,y,parity\nR0C2,10,5,2\n", "line 2: parity is 2"),
        ("positioner,x,y,alpha,beta\nR0C2,10,5,90,\n", "line 2: beta is empty, and only the other angle is given"),
    ],
)
def test_bad_targets(tmp_path, text, message):
    path = tmp_path / "field.csv"
    path.write_text(text)
    found = complaint(TargetError, lambda: Targets.read(path))
    assert found.startswith(f"{path}: {message}")


def test_bad_targets_in_other_formats(tmp_path):
    path = tmp_path / "field.ecsv"
    head = "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: x, unit: UNIT, datatype: float64}\n"
    head += "# - {name: y, datatype: float64}\n"
    path.write_text(head.replace("UNIT", "furlongs") + "x y\n1 2\n")
    assert complaint(TargetError, lambda: Targets.read(path)) == f"{path}: column 'x': unknown unit 'furlongs'"
    path.write_text(head.replace("UNIT", "mm") + "x y\n1 2\nnan 2\n")
    assert complaint(TargetError, lambda: Targets.read(path)) == (
        f"{path}: line 8: x is nan; --conflicts drop leaves it out"
    )
    path.write_text(head.replace("UNIT", "mm") + "x y\n1 two\n")
    assert "cannot be read as a table" in complaint(TargetError, lambda: Targets.read(path))
    assert "no such file" in complaint(TargetError, lambda: Targets.read(tmp_path / "none.ecsv"))
    assert "is a folder" in complaint(TargetError, lambda: Targets.read(tmp_path))


def test_truncated_table(tmp_path):
    from astropy.table import Table

    path = tmp_path / "field.fits"
    Table({"x": np.arange(2000.0), "y": np.arange(2000.0)}).write(path)
    content = path.read_bytes()
    for length in (1000, len(content) // 2, len(content) - 2880):
        path.write_bytes(content[:length])
        text = complaint(TargetError, lambda: Targets.read(path))
        assert "truncated" in text or "cannot be read as a table" in text


def test_positioners_that_do_not_fit(tmp_path, small_plane):
    path = tmp_path / "field.csv"
    path.write_text("x,y\n1,2\n")
    assert "or let `fiberplan allocate` say it" in complaint(TargetError, lambda: Targets.read(path).solve(small_plane))
    assert "or let `fiberplan allocate` say it" in complaint(
        TargetError, lambda: Targets.read(path).configuration(small_plane)
    )
    path.write_text(HEAD + GOOD + "R+1C3,1,2\n")
    text = complaint(TargetError, lambda: Targets.read(path).solve(small_plane))
    assert text == f"{path}: line 3: hexagonal has no positioner 'R+1C3'; did you mean 'R+1C2'?"


def test_many_targets_out_of_reach_make_one_line(small_plane):
    targets = Targets(np.full(7, 500.0), np.zeros(7), small_plane.ids)
    text = complaint(TargetError, lambda: targets.configuration(small_plane))
    assert text.count("out of reach") == 1
    assert text.endswith("; and 3 more")


def test_touching_goals_are_both_named(small_plane):
    x, y = small_plane.base[3:5].mean(axis=0)
    targets = Targets([x, x + 0.5], [y, y], small_plane.ids[3:5])
    text = complaint(ProblemError, lambda: Problem.from_targets(small_plane, targets))
    assert "'R0C2' and positioner 'R0C3' overlap" in text
    problem = Problem.from_targets(small_plane, targets, conflicts="drop")
    assert list(problem.dropped) == [3]


def test_start_in_contact(small_plane):
    start = small_plane.folded.copy()
    start[3], start[4] = (0.0, 0.0), (np.pi, 0.0)
    targets = Targets([small_plane.base[0, 0] + 10], [small_plane.base[0, 1]], small_plane.ids[:1])
    text = complaint(ProblemError, lambda: Problem.from_targets(small_plane, targets, start=start, near_start="raise"))
    assert text.startswith("start: positioner 'R0C2' and positioner 'R0C3' overlap")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: [*rows, rows[0]], "line 9: positioner 'R-1C1' was already given in line 2"),
        (lambda rows: [*rows, "R9C9,0,180"], "line 9: hexagonal has no positioner 'R9C9'"),
        (lambda rows: [*rows[:-1], "R+1C2,inf,180"], "line 8: alpha is inf"),
        (lambda rows: [], "the table has no rows"),
    ],
)
def test_bad_start(tmp_path, small_plane, change, message):
    path = tmp_path / "start.csv"
    rows = [f"{id_},0,180" for id_ in small_plane.ids]
    path.write_text("\n".join(["positioner,alpha,beta", *change(rows)]) + "\n")
    text = complaint(ProblemError, lambda: read_state(path, small_plane))
    assert text.startswith(f"{path}: {message}")


def test_bad_start_columns(tmp_path, small_plane):
    path = tmp_path / "start.csv"
    path.write_text("positioner,alpha [mm],beta\nR0C2,1,2\n")
    text = complaint(ProblemError, lambda: read_state(path, small_plane))
    assert text == f"{path}: column 'alpha': unit 'mm' is not an angle"
    assert "no such file" in complaint(ProblemError, lambda: read_state(tmp_path / "none.csv", small_plane))


@pytest.mark.parametrize("seed", [-1, 1.5, True, None])
def test_seeds_of_made_up_fields(seed, small_plane):
    for make in (
        lambda: clustered_targets(small_plane, seed),
        lambda: uniform_field(small_plane, seed),
        lambda: clustered_sky(2, 0.01, 5.0, seed),
    ):
        assert complaint(ProblemError, make) == f"seed must be a whole number of 0 or more, got {seed!r}"
