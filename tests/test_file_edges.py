"""Files that are not what they should be: one line each, whatever a well-meaning person or an enemy did to them."""

import contextlib
import io
import json
import os
import re
import threading
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from astropy.io import fits
from astropy.table import Table

from fiberplan.cli.app import run
from fiberplan.errors import FiberplanError, InstrumentError, PlanError, ProblemError, TargetError
from fiberplan.focal_plane import Body, FocalPlane, Obstacle
from fiberplan.io.sealed_tables import DIGEST, FOCAL_PLANE, PLAN, digest
from fiberplan.io.states import read_state
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.planners import PLANNERS
from fiberplan.problem import Problem, Targets
from fiberplan.tables.table_reader import read_table

pytestmark = pytest.mark.small


@pytest.fixture
def path(tmp_path, small_plan):
    small_plan.write(tmp_path / "plan.fits")
    return tmp_path / "plan.fits"


def forge(path, change, kind=PLAN):
    """Change a file and give it the digest that goes with it."""
    with fits.open(io.BytesIO(path.read_bytes())) as hdul:
        change(hdul)
        draft = io.BytesIO()
        hdul.writeto(draft)
    with fits.open(io.BytesIO(draft.getvalue()), lazy_load_hdus=False) as hdul:
        sealed = digest(kind, hdul, draft.getvalue())
    path.write_bytes(draft.getvalue())
    fits.setval(path, DIGEST, value=sealed)


def rows_of(hdul, name, rows):
    """A table of the file with other rows."""
    hdul[name] = fits.BinTableHDU(hdul[name].data[rows], name=name)


def complaint(kind, act):
    with pytest.raises(kind) as caught:
        act()
    assert "\n" not in str(caught.value)
    return str(caught.value)


# read once


@pytest.mark.large
def test_a_plan_that_is_replaced_while_it_is_read_is_one_or_the_other(path, small_plan):
    other = Plan(small_plan.problem, Trajectory.at_rest(small_plan.problem.start), small_plan.outcomes, "none")
    done, contents = threading.Event(), [path.read_bytes()]
    other.write(path)
    contents.append(path.read_bytes())

    def replace():
        beside = path.with_suffix(".new")
        while not done.is_set():
            for content in contents:
                beside.write_bytes(content)
                beside.replace(path)

    thread = threading.Thread(target=replace)
    thread.start()
    try:
        for _ in range(20):
            assert Plan.read(path).planner in ("greedy-fold", "none")
    finally:
        done.set()
        thread.join()


def test_pipes_are_read_and_devices_are_not(tmp_path, path, small_plane):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for read in (Plan.read, lambda pipe: read_state(pipe, small_plane), FocalPlane.load):
        if read is FocalPlane.load:
            pipe = pipe.rename(tmp_path / "pipe.fits")
        writer = threading.Thread(target=pipe.write_bytes, args=(path.read_bytes(),))
        writer.start()
        read(pipe)
        writer.join()
    for read, error in (
        (Plan.read, PlanError),
        (Targets.read, TargetError),
        (lambda path: read_state(path, small_plane), ProblemError),
        (lambda path: read_table(path, FiberplanError), FiberplanError),
    ):
        assert complaint(error, lambda read=read: read("/dev/zero")) == "/dev/zero: is a device, expected a file"
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    assert "is a device" in complaint(InstrumentError, lambda: FocalPlane.load(tmp_path / "zero.toml"))


def test_what_is_too_large_is_not_read(tmp_path, monkeypatch):
    large = tmp_path / "large.fits"
    with large.open("wb") as file:
        file.truncate(2**40)
    assert "is larger than 4 GiB, the most that is read" in complaint(PlanError, lambda: Plan.read(large))
    monkeypatch.setattr("fiberplan.tables.contents.STREAM", 1000)
    os.mkfifo(tmp_path / "pipe")

    def pour():
        with contextlib.suppress(BrokenPipeError):
            (tmp_path / "pipe").write_bytes(bytes(10**6))

    writer = threading.Thread(target=pour)
    writer.start()
    assert "is larger than" in complaint(PlanError, lambda: Plan.read(tmp_path / "pipe"))
    writer.join()


# the digest covers what is read


@pytest.mark.parametrize("keyword", ["TSCAL9", "TZERO9", "TNULL1", "TDIM9", "THEAP"])
def test_keywords_that_change_values_are_refused(path, keyword):
    value = {"TSCAL9": 0.1, "TZERO9": 1.0, "TNULL1": 0, "TDIM9": "(1)", "THEAP": 100}[keyword]
    fits.setval(path, keyword, value=value, extname="BODIES")
    expected = f"table BODIES: {keyword} changes its values"
    assert expected in complaint(PlanError, lambda: Plan.read(path))
    assert expected in complaint(InstrumentError, lambda: FocalPlane.load(path))


def test_a_focal_plane_has_a_digest(tmp_path, small_plane, path):
    own = tmp_path / "plane.fits"
    small_plane.write(own)
    assert FocalPlane.load(own).ids == small_plane.ids
    for file in (own, path):
        content = bytearray(file.read_bytes())
        content[content.index(np.array([1.5], ">f8").tobytes())] ^= 1  # the radius of the body
        file.write_bytes(content)
        assert complaint(InstrumentError, lambda file=file: FocalPlane.load(file)).endswith(
            "is damaged: its data do not match their SHA-256"
        )


def test_a_focal_plane_of_before_it_had_a_digest(tmp_path, small_plane):
    own = tmp_path / "plane.fits"
    small_plane.write(own)
    fits.setval(own, FOCAL_PLANE.keyword, value=2)
    assert "is in focal plane format 2" in complaint(InstrumentError, lambda: FocalPlane.load(own))
    fits.delval(own, FOCAL_PLANE.keyword)
    assert "is damaged: it has a FPSHA256 but no" in complaint(InstrumentError, lambda: FocalPlane.load(own))
    fits.delval(own, DIGEST)
    np.testing.assert_array_equal(FocalPlane.load(own).base, small_plane.base)


@pytest.mark.parametrize("version", [0, -5, True, 1.0, "2"])
def test_versions_that_are_none(path, version):
    fits.setval(path, "FPFORMAT", value=version)
    assert "expected 1 or more" in complaint(PlanError, lambda: Plan.read(path))


# columns decide, not the order of rows


@pytest.fixture
def shaped(tmp_path, small_plane):
    """A plane with bodies of every kind, and where it is written."""
    n = small_plane.n
    bodies = (
        Body(np.array([[0.0, 0.0], [15.0, 0.0]]), np.linspace(1.0, 1.6, n), name="arm"),
        Body(
            np.arange(n)[:, None, None] / 10 + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
            0.1,
            closed=True,
            name="cap",
        ),
        Body(np.array([[0.0, 0.0]]), 0.5, link="base", name="post"),
    )
    fixed = tuple(Obstacle(f"F{k}", [[100.0 * k, 90.0], [100.0 * k + 1, 90.0]], 1.0) for k in (1, 2))
    plane = small_plane.replace(bodies=bodies, obstacles=fixed)
    plane.write(tmp_path / "shaped.fits")
    return plane, tmp_path / "shaped.fits"


def test_rows_in_another_order_are_the_same_bodies(shaped):
    plane, path = shaped
    rng = np.random.default_rng(3)

    def shuffle(hdul):
        for name in ("BODIES", "OBSTACLES"):
            rows_of(hdul, name, rng.permutation(len(hdul[name].data)))

    forge(path, shuffle, FOCAL_PLANE)
    read = FocalPlane.load(path)
    for one, other in zip((*plane.bodies, *plane.obstacles), (*read.bodies, *read.obstacles), strict=True):
        np.testing.assert_array_equal(one.points, other.points)
        np.testing.assert_array_equal(one.radius, other.radius)
        assert (one.name, one.category, one.meets, one.closed) == (
            other.name,
            other.category,
            other.meets,
            other.closed,
        )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t[[k for k in range(len(t)) if k not in (2, 3)]], "body 0 'arm': no row of positioner 'R-1C2'"),
        (lambda t: t[1:], "body 0 'arm', positioner 'R-1C1': vertex 0 is missing"),
        (lambda t: t[[k for k in range(len(t)) if k != 3]], "positioner 'R-1C2': 1 vertices, where the first"),
        (lambda t: t[[0, 0, *range(2, len(t))]], "body 0 'arm', positioner 'R-1C1': vertex 0 is double"),
        (lambda t: t[[0, *range(len(t))]], "body 0 'arm', positioner 'R-1C1': vertex 0 is double"),
        (lambda t: setcell(t, "positioner", 3, 99), "body 0 'arm': there is no positioner 99"),
        (lambda t: setcell(t, "positioner", 3, -2), "body 0 'arm': there is no positioner -2"),
        (lambda t: setcell(t, "positioner", 3, -1), "body 0 'arm': rows of positioner -1, which stands for all"),
        (lambda t: setcell(t, "body", 3, 7), "BODIES: body 7 is there, but they are counted from 0"),
        (lambda t: setcell(t, "body", 3, -1), "BODIES: body -1 is there, but they are counted from 0"),
        (lambda t: setcell(t, "radius", 3, 9.0), "positioner 'R-1C2': its rows have more than one radius"),
        (lambda t: setcell(t, "link", 3, b"base"), "body 0: its rows have more than one link"),
        (lambda t: setcell(t, "closed", 3, True), "body 0: its rows have more than one closed"),
    ],
)
def test_rows_that_do_not_fit_are_named(shaped, change, words):
    _, path = shaped

    def spoil(hdul):
        hdul["BODIES"] = fits.BinTableHDU(change(hdul["BODIES"].data.copy()), name="BODIES")

    forge(path, spoil, FOCAL_PLANE)
    assert words in complaint(InstrumentError, lambda: FocalPlane.load(path))


def setcell(table, column, row, value):
    table[column][row] = value
    return table


@pytest.mark.parametrize(
    ("table", "column", "value", "words"),
    [
        ("PROBLEM", "positioner", "R0C9", "row 3: positioner 'R0C9' in PROBLEM, but 'R0C1' in POSITIONERS"),
        ("POSITIONERS", "outcome", "OFFLINE", "'R0C1': outcome ARRIVED in PROBLEM, but OFFLINE in POSITIONERS"),
        ("PROBLEM", "outcome", "LOST", "positioner 'R0C1': there is no outcome 'LOST'"),
        ("KNOTS", "positioner", 9, "KNOTS: row 3: positioner 9 is not there, or not in its place"),
        ("KNOTS", "positioner", -1, "KNOTS: row 3: positioner -1 is not there, or not in its place"),
        ("KNOTS", "positioner", 5, "KNOTS: row 4: positioner 1 is not there, or not in its place"),
    ],
)
def test_tables_that_contradict_each_other(path, table, column, value, words):
    forge(path, lambda hdul: setcell(hdul[table].data, column, 2, value))
    assert words in complaint(PlanError, lambda: Plan.read(path))


# what a plan says of its problem


@pytest.mark.parametrize(
    ("i", "outcome", "words"),
    [
        (0, Outcome.OFFLINE, "'R-1C1': its outcome is OFFLINE, but it is online and has a goal"),
        (0, Outcome.NO_TARGET, "'R-1C1': its outcome is NO_TARGET, but it is online and has a goal"),
        (0, "ARRIVED", "'R-1C1': its outcome is ARRIVED, but it is online and has a goal"),
        (1, Outcome.ARRIVED, "'R-1C2': its outcome is ARRIVED, but its goal was dropped"),
        (4, Outcome.ARRIVED, "'R0C3': its outcome is ARRIVED, but no goal is requested of it"),
        (4, Outcome.DROPPED, "'R0C3': its outcome is DROPPED, but no goal is requested of it"),
        (6, Outcome.DEADLOCKED, "'R+1C2': its outcome is DEADLOCKED, but it is not online"),
    ],
)
def test_outcomes_that_the_problem_rules_out(small_plan, i, outcome, words):
    outcomes = list(small_plan.outcomes)
    outcomes[i] = outcome
    text = complaint(PlanError, lambda: Plan(small_plan.problem, small_plan.trajectory, tuple(outcomes), "none"))
    assert words in text


def test_everyone_offline_on_a_plane_that_is_online(path):
    """Nobody who reads it would ask whether anybody arrives."""

    def spoil(hdul):
        for name in ("PROBLEM", "POSITIONERS"):
            hdul[name].data["outcome"] = "OFFLINE"

    forge(path, spoil)
    assert "its outcome is OFFLINE, but it is online" in complaint(PlanError, lambda: Plan.read(path))


@pytest.mark.parametrize("margin", [True, np.True_, "1", None, -1.0, np.nan, [1.0]])
def test_margin_is_a_length(small_plane, margin):
    text = complaint(ProblemError, lambda: Problem(small_plane, small_plane.folded, small_plane.folded, margin))
    assert text.startswith(("margin must be a length of 0 mm or more, got ", "margin must be one number [mm], got "))


@pytest.mark.parametrize("fibers", [{"a": [15.0, 0.0], "b": [15.0, 0.4]}, {"b": [15.0, 0.4], "a": [15.0, 0.0]}])
def test_arriving_is_of_every_fiber(fibers):
    """The other elbow brings the fiber on the middle line of its link to the same place, and the next one off it."""
    plane = FocalPlane.hexagonal(0, 22.4, upper=(2 * np.pi, 2 * np.pi)).replace(fiber_offsets=fibers)
    goal = np.radians([[30.0, 80.0]])
    other = _other_elbow(plane, goal)
    problem = Problem(plane, plane.folded, goal)
    motion = Trajectory.from_samples([0.0, 30.0], np.stack([plane.folded, other]))
    (fault,) = Plan(problem, motion, (Outcome.ARRIVED,), "none").faults()
    assert re.search(r"is said to arrive but ends 0\.\d+ mm from its goal", fault)
    allowed = Problem(plane, plane.folded, goal, alternatives=other[:, None])
    assert not Plan(allowed, motion, (Outcome.ARRIVED,), "none").faults()


def _other_elbow(plane, goal):
    x, y = (plane.fibers(goal, "a") - plane.base)[0]
    return np.array([[2 * np.arctan2(y, x) - goal[0, 0], 2 * np.pi - goal[0, 1]]])


@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("seed", [-1, 2**64, 2**63, 1.5, True, None])
def test_seeds_that_are_none(name, seed):
    text = complaint(ProblemError, lambda: PLANNERS[name](seed=seed))
    assert text == f"{name}: seed must be a whole number from 0 to {2**63 - 1}, got {seed!r}"
    PLANNERS[name](seed=np.int64(2**63 - 1))


def test_seed_of_the_command_and_of_a_plan(path, capsys):
    assert run(["plan", "hexagonal", "none.csv", "--seed", str(2**64)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1

    def spoil(hdul):
        said = json.loads(hdul["PARAMETERS"].data["json"][0])
        hdul["PARAMETERS"].data["json"] = json.dumps(said | {"seed": -1})

    forge(path, spoil)
    assert "seed must be a whole number" in complaint(PlanError, lambda: Plan.read(path))


# files that are no files


@pytest.mark.parametrize(
    "hdu",
    [
        fits.ImageHDU(np.zeros((3, 3))),
        fits.ImageHDU(),
        fits.BinTableHDU(),
        fits.TableHDU.from_columns([fits.Column("x", "I5", array=[1, 2])]),
        fits.CompImageHDU(np.zeros((30, 30), np.int16)),
    ],
)
def test_other_hdus(path, tmp_path, small_plane, hdu):
    small_plane.write(tmp_path / "plane.fits")
    for file, error, read in (
        (path, PlanError, Plan.read),
        (tmp_path / "plane.fits", InstrumentError, FocalPlane.load),
    ):
        with fits.open(io.BytesIO(file.read_bytes())) as hdul:
            hdul.append(hdu.copy())
            hdul.writeto(file, overwrite=True)
        text = complaint(error, partial(read, file))
        assert "not written by fiberplan" in text or "damaged" in text


def test_a_table_that_is_there_twice(path):
    def double(hdul):
        hdul.append(hdul["BODIES"].copy())

    forge(path, double)
    assert "table BODIES is there twice" in complaint(PlanError, lambda: Plan.read(path))


@pytest.mark.large
def test_flipped_header_bytes_are_one_line(path):
    content, rng = path.read_bytes(), np.random.default_rng(8)
    headers = [k for k in range(0, len(content), 2880) if content[k : k + 8] in (b"SIMPLE  ", b"XTENSION")]
    for k in range(60):
        spoiled = bytearray(content)
        for place in rng.choice(headers) + rng.integers(0, 1600, 2):
            spoiled[place] = rng.integers(256)
        path.write_bytes(spoiled)
        with contextlib.suppress(PlanError, InstrumentError):
            (Plan.read, FocalPlane.load)[k % 2](path)


@pytest.mark.parametrize(
    ("naxis1", "naxis2", "form"),
    [(0, 10**12, "0D"), (0, 10**12, "D"), (8, 10**12, "D"), (10**12, 0, f"{10**12 // 8}D")],
)
def test_sizes_are_held_against_the_file_before_anything_is_made(path, naxis1, naxis2, form):
    with fits.open(io.BytesIO(path.read_bytes())) as hdul:
        hdul.writeto(path, overwrite=True)
    content = path.read_bytes()
    header = fits.Header.fromstring(content[2880:5760].decode())
    header["NAXIS1"], header["NAXIS2"], header["TFIELDS"], header["TFORM1"] = naxis1, naxis2, 1, form
    path.write_bytes(content[:2880] + header.tostring().encode())
    complaint(PlanError, lambda: Plan.read(path))
    complaint(InstrumentError, lambda: FocalPlane.load(path))


def test_json_that_is_nested_too_deep(path):
    def nest(hdul):
        deep = "[" * 100_000 + "]" * 100_000
        hdul["PARAMETERS"] = fits.BinTableHDU.from_columns(
            [fits.Column("json", f"{len(deep)}A", array=[deep])], name="PARAMETERS"
        )

    forge(path, nest)
    assert "cannot be used as a plan" in complaint(PlanError, lambda: Plan.read(path))


@pytest.mark.parametrize("text", ["[]", "{}", "1", '{"problem": 1}', "nonsense", "NaN"])
def test_json_that_says_something_else(path, text):
    def change(hdul):
        hdul["PARAMETERS"] = fits.BinTableHDU.from_columns(
            [fits.Column("json", f"{len(text)}A", array=[text])], name="PARAMETERS"
        )

    forge(path, change)
    complaint(PlanError, lambda: Plan.read(path))


@pytest.mark.parametrize(
    "text", ["x = " + "[" * 20_000 + "]" * 20_000, "x = " + "9" * 10_000, "x = 1979-13-45", "a." * 2_000 + "a = 1"]
)
def test_toml_that_python_cannot_hold(tmp_path, text):
    path = tmp_path / "array.toml"
    path.write_text(text)
    assert str(path) in complaint(InstrumentError, lambda: FocalPlane.load(path))


@pytest.mark.parametrize("name", ["a\0b.fits", "a\0b.toml", "x" * 300 + ".fits"])
def test_names_that_no_file_has(name):
    complaint(InstrumentError, lambda: FocalPlane.load(name))
    complaint(PlanError, lambda: Plan.read(name))
    complaint(TargetError, lambda: Targets.read(name))


def test_ecsv_and_fits_tables_are_read_once(tmp_path, monkeypatch):
    Table({"x": [1.0, 2.0], "y": [3.0, 4.0]}).write(tmp_path / "t.ecsv")
    Table({"x": [1.0, 2.0], "y": [3.0, 4.0]}).write(tmp_path / "t.fits")
    opened = []
    real = Path.open

    def noted(self, *arguments, **named):
        if self.parent == tmp_path:  # the registry looks at other packages once
            opened.append(self.name)
        return real(self, *arguments, **named)

    monkeypatch.setattr(Path, "open", noted)
    for name in ("t.ecsv", "t.fits"):
        assert len(Targets.read(tmp_path / name).x) == 2
    assert opened == ["t.ecsv", "t.fits"]
