"""The command line from outside: what it prints, what it writes, how it exits."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from astropy import units
from astropy.io import fits
from astropy.table import QTable, Table

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import interrupted
from fiberplan.scenes.uniform import uniform_field

MARGIN = 0.8
COMMAND = [sys.executable, "-c", "from fiberplan.cli import main; main()"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(fp.__file__).parents[1])}  # wherever a test makes its folder


@pytest.fixture(scope="session")
def scene():
    """Nineteen positioners that reach over each other, and a field that straight motion would not survive."""
    plane = fp.FocalPlane.hexagonal(2, 22.4)
    return plane, uniform_field(plane, seed=3, margin=MARGIN)


@pytest.fixture
def folder(tmp_path, scene, monkeypatch):
    """A working folder with an instrument and a table of targets."""
    plane, goal = scene
    monkeypatch.chdir(tmp_path)
    plane.write("plane.fits")
    table(plane, goal).write("field.ecsv")
    return tmp_path


@pytest.fixture(scope="session")
def plan(scene):
    plane, goal = scene
    return fp.planners.GreedyFold().plan(fp.Problem(plane, plane.folded, goal, MARGIN))


def table(plane, goal):
    x, y = plane.fibers(goal).T
    return QTable({"positioner": list(plane.ids), "x": x * units.mm, "y": y * units.mm})


def listing(folder):
    return {path.name: path.lstat().st_mtime_ns for path in folder.iterdir()}


def refused(folder, capsys, *arguments):
    """The one line on stderr with which a command is refused, having written nothing."""
    before = listing(folder)
    assert run([str(argument) for argument in arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert listing(folder) == before
    (line,) = err.splitlines()
    prefix = "fiberplan: error: "
    assert line.startswith(prefix)
    return line.removeprefix(prefix)


def test_plan_verify_show_export(folder, scene, capsys):
    plane, _ = scene
    options = ["--margin", str(MARGIN), "-o", "plan.fits", "--page", "plan.html"]
    assert run(["plan", "plane.fits", "field.ecsv", *options]) == 0
    out, _ = capsys.readouterr()
    assert out.startswith("19 of 19 arrived in ")
    assert "safe: smallest proven clearance" in out
    assert out.endswith("wrote plan.fits and plan.html\n")

    assert run(["verify", "plan.fits"]) == 0
    assert capsys.readouterr().out.startswith("safe: ")

    assert run(["show", "plan.fits", "-o", "again.html"]) == 0
    assert (folder / "again.html").read_bytes() == (folder / "plan.html").read_bytes()

    assert run(["export", "plan.fits", "--to", "ecsv", "-o", "plan.ecsv"]) == 0
    motion = fp.Plan.read("plan.fits").trajectory
    rows = QTable.read("plan.ecsv")
    assert rows.colnames == ["positioner", "time", "alpha", "beta"]
    assert rows.meta["instrument"] == plane.name
    assert rows.meta["certified"] is True
    assert np.allclose(rows["alpha"].to_value("rad"), motion.angles[:, 0], rtol=0, atol=1e-14)
    assert np.array_equal(rows["time"].to_value("s"), motion.times)
    assert list(rows["positioner"]) == [plane.ids[i] for i in np.repeat(np.arange(19), np.diff(motion.offsets))]


def test_show_writes_beside_the_plan(folder, plan):
    (folder / "night").mkdir()
    plan.write("night/one.fits")
    assert run(["show", "night/one.fits"]) == 0
    assert (folder / "night" / "one.html").exists()


def test_plan_without_output_writes_nothing(folder, capsys):
    before = listing(folder)
    assert run(["plan", "plane.fits", "field.ecsv"]) == 0
    assert "nothing written" in capsys.readouterr().out
    assert listing(folder) == before


def test_plan_is_the_same_again(folder):
    for name in ("one", "two"):
        assert run(["plan", "plane.fits", "field.ecsv", "--seed", "5", "-o", f"{name}.fits"]) == 0
    one, two = (fp.Plan.read(f"{name}.fits").trajectory for name in ("one", "two"))
    assert np.array_equal(one.angles, two.angles)
    assert np.array_equal(one.times, two.times)


def test_settings_reach_the_planner(folder, capsys):
    """From a file and, over it, one by one; what a planner refuses is one line."""
    (folder / "mine.toml").write_text("max_travel = 600\nstep = 5\n")
    settings = ["--planner", "greedy-fold", "--settings", "mine.toml", "--set", "step=0.5", "--set", "skip_noops=false"]
    run(["plan", "plane.fits", "field.ecsv", *settings, "--seed", "7", "-o", "plan.fits"])
    read = fp.Plan.read("plan.fits")
    assert read.seed == 7
    assert read.parameters["step"] == pytest.approx(np.radians(0.5), abs=1e-15)
    assert read.parameters["max_travel"] == pytest.approx(np.radians(600), abs=1e-12)
    assert read.parameters["skip_noops"] is False
    capsys.readouterr()
    bad = ["plan", "plane.fits", "field.ecsv", "--planner", "navigation-function"]
    assert "d must be below D, got d 5 mm and D 4 mm" in refused(folder, capsys, *bad, "--set", "d=5")
    assert "beyond its patrol zone" in refused(folder, capsys, *bad, "--set", "dt=5")
    (folder / "mine.toml").rename("mine.fits")
    assert "mine.fits is an input" in refused(folder, capsys, *bad, "--settings", "mine.fits", "-o", "mine.fits")


def touching(plane, goal):
    """The field with one target moved onto a neighbour's arm."""
    goal = goal.copy()
    for i, j in plane.pairs:
        for alpha in np.radians(np.arange(0.0, 360.0, 5.0)):
            goal[i] = alpha, 0.3
            gap = plane.clearance(goal)[(plane.pairs == (i, j)).all(axis=1)][0]
            others = plane.clearance(goal)[~(plane.pairs == (i, j)).all(axis=1)]
            if gap < 0 and others.min() > 1.0:
                return goal, plane.ids[i], plane.ids[j]
    raise AssertionError("no such pose")


def test_touching_goals_are_refused_or_dropped(folder, scene, capsys):
    plane, goal = scene
    goal, one, other = touching(plane, goal)
    table(plane, goal).write("touching.ecsv")
    line = refused(folder, capsys, "plan", "plane.fits", "touching.ecsv", "-o", "plan.fits")
    assert one in line
    assert other in line
    assert "overlap (clearance" in line
    assert run(["plan", "plane.fits", "touching.ecsv", "--conflicts", "drop", "-o", "plan.fits"]) == 1
    out, _ = capsys.readouterr()
    assert out.startswith("18 of 19 arrived")
    (lost,) = [line for line in out.splitlines() if line.startswith("lost ")]
    assert "touches something at rest" in lost
    assert "in the way: " in lost
    assert "safe: " in out
    assert run(["verify", "plan.fits"]) == 0


def test_verify_tells_what_touches(folder, plan, capsys):
    plan.write("plan.fits")
    assert run(["verify", "plan.fits", "--margin", "6"]) == 1
    out, _ = capsys.readouterr()
    assert "contact: R" in out
    assert " s, clearance " in out
    assert out.splitlines()[-1].startswith("not safe: ")
    assert run(["verify", "plan.fits", "--jitter", "20", "--position-error", "2"]) == 1


def test_verify_finds_a_wrong_claim(folder, scene, capsys):
    plane, goal = scene
    problem = fp.Problem(plane, plane.folded, goal)
    still = fp.Trajectory.at_rest(plane.folded)
    fp.Plan(problem, still, (fp.Outcome.ARRIVED,) * plane.n, "greedy-fold").write("claim.fits")
    assert run(["verify", "claim.fits"]) == 1
    assert "is said to arrive but ends" in capsys.readouterr().out


def bad_tables(plane, goal):
    """Name -> (table, words that the refusal must contain)."""
    good = table(plane, goal)
    x = good["x"].to_value("mm")

    def changed(**columns):
        new = good.copy()
        for name, column in columns.items():
            new[name] = column
        return new

    def first(value):
        return np.concatenate([[value], x[1:]]) * units.mm

    without = good.copy()
    without.remove_column("y")
    unassigned = good.copy()
    unassigned.remove_column("positioner")
    ids = [plane.ids[0], plane.ids[0], *plane.ids[2:]]
    return {
        "column": (without, ("'y'",)),
        "unassigned": (unassigned, ("positioner", "assign")),
        "nan": (changed(x=first(np.nan)), ("line ", "nan")),
        "infinite": (changed(x=first(np.inf)), ("line ", "inf")),
        "twice": (changed(positioner=ids), (plane.ids[0],)),
        "stranger": (changed(positioner=["R+99C1", *plane.ids[1:]]), ("R+99C1",)),
        "unit": (changed(x=x * units.s), ("'x'", "s")),
        "reach": (changed(x=first(500.0)), (plane.ids[0], "reach")),
        "empty": (good[:0], ("no ",)),
    }


BAD_TABLES = ["column", "unassigned", "nan", "infinite", "twice", "stranger", "unit", "reach", "empty"]


@pytest.mark.parametrize("name", BAD_TABLES)
def test_bad_tables(folder, scene, capsys, name):
    bad, words = bad_tables(*scene)[name]
    bad.write("bad.ecsv")
    line = refused(folder, capsys, "plan", "plane.fits", "bad.ecsv", "-o", "plan.fits", "--page", "plan.html")
    for word in ("bad.ecsv" if name != "reach" else "", *words):
        assert word.lower() in line.lower()


def test_unknown_unit(folder, scene, capsys):
    text = (folder / "field.ecsv").read_text()
    (folder / "bad.ecsv").write_text(text.replace("unit: mm", "unit: furlongs"))
    line = refused(folder, capsys, "plan", "plane.fits", "bad.ecsv", "-o", "plan.fits")
    assert "furlongs" in line


def test_missing_files(folder, capsys):
    assert "none.ecsv" in refused(folder, capsys, "plan", "plane.fits", "none.ecsv", "-o", "plan.fits")
    assert "none.fits" in refused(folder, capsys, "verify", "none.fits")
    assert "none.fits" in refused(folder, capsys, "show", "none.fits")
    assert "none.fits" in refused(folder, capsys, "export", "none.fits", "--to", "ecsv", "-o", "plan.ecsv")
    line = refused(folder, capsys, "plan", "plane.fits", "field.ecsv", "--start", "none.ecsv", "-o", "plan.fits")
    assert "none.ecsv" in line


def test_unknown_names_suggest_the_nearest(folder, capsys):
    assert "sdss" in refused(folder, capsys, "plan", "sdsss", "field.ecsv", "-o", "plan.fits")
    assert "sdss" in refused(folder, capsys, "instruments", "sdsss")
    line = refused(folder, capsys, "plan", "plane.fits", "field.ecsv", "--planner", "greedy-fald", "-o", "plan.fits")
    assert "did you mean 'greedy-fold'?" in line
    assert "sayres2021" in refused(folder, capsys, "reproduce", "sayres2020")


@pytest.mark.parametrize(
    "options",
    [
        ["--margin", "-1"],
        ["--margin", "nan"],
        ["--margin", "thick"],
        ["--planner", "greedy-fold", "--set", "step=0"],
        ["--planner", "greedy-fold", "--set", "step=nan"],
        ["--planner", "greedy-fold", "--set", "max_travel=-5"],
        ["--planner", "greedy-fold", "--set", "relief=none-of-them"],
        ["--settings", "no-such-file.toml"],
        ["--conflicts", "ignore"],
        ["--seed", "-1"],
        ["--seed", "9" * 23],
        ["--no-such-option"],
    ],
)
def test_bad_options(folder, capsys, options):
    refused(folder, capsys, "plan", "plane.fits", "field.ecsv", "-o", "plan.fits", *options)


def test_start_in_contact(folder, scene, capsys):
    plane, goal = scene
    bad, one, other = touching(plane, goal)
    alpha, beta = np.degrees(bad).T
    rows = {"positioner": list(plane.ids), "alpha": alpha * units.deg, "beta": beta * units.deg}
    QTable(rows).write("start.ecsv")
    line = refused(folder, capsys, "plan", "plane.fits", "field.ecsv", "--start", "start.ecsv", "-o", "plan.fits")
    assert one in line
    assert other in line
    assert "start" in line


def test_reversed_joint_range(folder, scene, capsys):
    plane, _ = scene
    with fits.open("plane.fits") as hdus:
        for hdu in hdus[1:]:
            if "lower" in {name.lower().split("_")[0] for name in hdu.columns.names}:
                for name in hdu.columns.names:
                    if name.lower().startswith("lower"):
                        hdu.data[name] = 7.0
        del hdus[0].header["FPSHA256"], hdus[0].header["FPPLANE"]
        hdus.writeto("reversed.fits")
    line = refused(folder, capsys, "plan", "reversed.fits", "field.ecsv", "-o", "plan.fits")
    assert plane.ids[0] in line
    assert "range" in line


def test_truncated_plan(folder, plan, capsys):
    plan.write("plan.fits")
    content = (folder / "plan.fits").read_bytes()
    for part in (0, 1000, len(content) // 2, len(content) - 2880):
        (folder / "cut.fits").write_bytes(content[:part])
        assert "cut.fits" in refused(folder, capsys, "verify", "cut.fits")
    refused(folder, capsys, "show", "cut.fits", "-o", "plan.html")


def test_plan_of_a_newer_format(folder, plan, capsys):
    plan.write("plan.fits")
    fits.setval("plan.fits", "FPFORMAT", value=99)
    line = refused(folder, capsys, "verify", "plan.fits")
    assert "format 99" in line
    refused(folder, capsys, "plan", "plane.fits", "field.ecsv", "--start", "plan.fits", "-o", "new.fits")


def test_not_a_plan(folder, capsys):
    Table({"x": [1.0]}).write("table.fits")
    (folder / "text.fits").write_text("not FITS at all\n")
    assert "plane.fits" in refused(folder, capsys, "verify", "plane.fits")
    assert "table.fits" in refused(folder, capsys, "verify", "table.fits")
    assert "text.fits" in refused(folder, capsys, "verify", "text.fits")


@pytest.mark.parametrize("place", ["nowhere/plan.fits", "field.ecsv/plan.fits", "taken"])
@pytest.mark.parametrize("option", ["-o", "--page"])
def test_output_not_writable(folder, capsys, place, option):
    (folder / "taken").mkdir()
    assert place in refused(folder, capsys, "plan", "plane.fits", "field.ecsv", option, place)


def test_output_is_refused_before_any_work(folder, plan, capsys):
    plan.write("plan.fits")
    assert "field.ecsv" in refused(folder, capsys, "demo", "-o", "field.ecsv")
    assert "nowhere" in refused(folder, capsys, "show", "plan.fits", "-o", "nowhere/plan.html")
    assert "nowhere" in refused(folder, capsys, "export", "plan.fits", "--to", "ecsv", "-o", "nowhere/plan.ecsv")
    assert "field.ecsv" in refused(folder, capsys, "reproduce", "sayres2021", "-o", "field.ecsv/figures")


def test_inputs_are_not_overwritten(folder, plan, capsys):
    plan.write("plan.fits")
    refused(folder, capsys, "plan", "plane.fits", "field.ecsv", "-o", "field.ecsv")
    refused(folder, capsys, "plan", "plane.fits", "field.ecsv", "-o", "plane.fits")
    refused(folder, capsys, "plan", "plane.fits", "field.ecsv", "-o", "new.fits", "--page", "new.fits")
    refused(folder, capsys, "show", "plan.fits", "-o", "./plan.fits")


def test_outputs_end_as_what_they_are(folder, plan, capsys):
    plan.write("plan.fits")
    planned = ["plan", "plane.fits", "field.ecsv"]
    assert refused(folder, capsys, "show", "plan.fits", "-o", "x.gif") == (
        "x.gif: this command writes an HTML page, which ends in .html or .htm"
    )
    assert "writes a plan, which ends in .fits" in refused(folder, capsys, *planned, "-o", "plan.fits.gz")
    assert "writes an HTML page" in refused(folder, capsys, *planned, "--page", "page.fits")
    assert "an ECSV table" in refused(folder, capsys, "export", "plan.fits", "--to", "motions", "-o", "x.csv")
    for command in (planned, ["show", "plan.fits"], ["export", "plan.fits", "--to", "ecsv"]):
        assert refused(folder, capsys, *command, "-o", "-").startswith("-: stdout carries the answer in words; name")


def test_outputs_that_no_file_can_be_made_of(folder, plan, capsys):
    plan.write("plan.fits")
    (folder / "a.html").symlink_to("b.html")
    (folder / "b.html").symlink_to("a.html")
    assert "too many levels of symbolic links" in refused(folder, capsys, "show", "plan.fits", "-o", "a.html")
    (folder / "far.html").symlink_to("nowhere/page.html")
    assert "nowhere" in refused(folder, capsys, "show", "plan.fits", "-o", "far.html")
    os.link("plan.fits", "same.html")
    assert "is an input of this command" in refused(folder, capsys, "show", "plan.fits", "-o", "same.html")
    (folder / "null").symlink_to("/dev/null")
    assert run(["show", "plan.fits", "-o", "null"]) == 0
    assert (folder / "null").is_symlink()


def test_instruments(capsys):
    assert run(["instruments"]) == 0
    out = capsys.readouterr().out
    for name in ("sayres2021", "sdss", "hexagonal"):
        assert name in out
    assert run(["instruments", "sayres2021"]) == 0
    out = capsys.readouterr().out
    assert "547" in out
    assert "deg" in out


def test_reproduce_lists_papers(capsys):
    assert run(["reproduce"]) == 0
    assert "sayres2021" in capsys.readouterr().out.split()


@pytest.mark.slow
def test_demo(tmp_path, capsys):
    assert run(["demo", "-o", str(tmp_path / "demo")]) == 0
    assert sorted(path.name for path in (tmp_path / "demo").iterdir()) == ["plan.fits", "plan.html"]
    assert "open " in capsys.readouterr().out
    assert run(["verify", str(tmp_path / "demo" / "plan.fits")]) == 0


def test_a_bug_is_not_an_answer(folder, capsys, monkeypatch):
    def broken(path):
        raise KeyError("a bug")

    monkeypatch.setattr(fp.Plan, "read", broken)
    assert run(["verify", "plan.fits"]) == 70
    assert "this is a bug in fiberplan" in capsys.readouterr().err


def test_full_disk_is_one_line(folder, plan, capsys, monkeypatch):
    def full(path):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(fp.Plan, "read", full)
    assert refused(folder, capsys, "verify", "plan.fits") == "plan.fits: No space left on device"


def test_interrupt_is_one_line(folder, capsys, monkeypatch):
    def interrupted(path):
        raise KeyboardInterrupt

    monkeypatch.setattr(fp.Plan, "read", interrupted)
    assert run(["verify", "plan.fits"]) == 130
    assert capsys.readouterr().err == "fiberplan: error: interrupted\n"


def test_interrupt_within_a_kernel_is_no_bug(folder, capsys, monkeypatch):
    """Compiled code returns with the interrupt set, which CPython reports as a SystemError."""

    def interrupted(path):
        try:
            raise SystemError("returned a result with an exception set") from KeyboardInterrupt()
        except SystemError as error:
            raise ValueError("while unboxing") from error

    monkeypatch.setattr(fp.Plan, "read", interrupted)
    assert run(["verify", "plan.fits"]) == 130
    assert capsys.readouterr().err == "fiberplan: error: interrupted\n"


def test_interrupted_looks_at_causes_contexts_and_groups():
    def chained(error, **links):
        for name, value in links.items():
            setattr(error, name, value)
        return error

    pressed = KeyboardInterrupt()
    assert interrupted(pressed)
    assert interrupted(
        chained(SystemError(), __cause__=ValueError(), __context__=chained(OSError(), __cause__=pressed))
    )
    assert interrupted(BaseExceptionGroup("several", [ValueError(), pressed]))
    circle = ValueError()
    assert not interrupted(chained(circle, __context__=chained(OSError(), __context__=circle)))


@pytest.mark.parametrize("delay", [0.05, 0.4, 0.9, 1.6])
def test_interrupt_at_any_moment(folder, delay):
    """While modules are imported, kernels loaded and goals searched for: one line, never a traceback."""
    begun = "from fiberplan.cli import main; print('begun', flush=True); main()"
    arguments = ["plan", "plane.fits", "field.ecsv", "--planner", "prioritized-roadmap", "-o", "plan.fits"]
    command = [sys.executable, "-c", begun, *arguments]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, cwd=folder, env=ENVIRONMENT, **pipes) as process:
        process.stdout.readline()
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=120)
    assert process.returncode in (130, 0, 1), err  # it may have been faster than the signal
    if process.returncode == 130:
        assert err.splitlines()[-1] == "fiberplan: error: interrupted"


def test_interrupt_leaves_no_half_file(tmp_path):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen([*COMMAND, "demo"], cwd=tmp_path, env=ENVIRONMENT, **pipes)
    time.sleep(1.5)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=120)
    if process.returncode == 130:
        assert out == b""
        assert err.splitlines()[-1] == b"fiberplan: error: interrupted"
    for path in tmp_path.iterdir():  # it may have been faster than the signal: then all is there, whole
        assert path.name in ("plan.fits", "plan.html")
        if path.suffix == ".fits":
            fp.Plan.read(path)


def called(*arguments, stdout, **environment):
    """The command as a process of its own."""
    command, variables = [*COMMAND, *arguments], ENVIRONMENT | environment
    return subprocess.run(command, stdout=stdout, stderr=subprocess.PIPE, text=True, env=variables)


def test_pipe_is_quiet_and_a_reader_may_leave(folder, plan):
    plan.write("plan.fits")
    done = called("verify", "plan.fits", stdout=subprocess.PIPE)
    assert done.returncode == 0
    assert done.stdout.startswith("safe: ")
    assert "\x1b" not in done.stdout + done.stderr
    assert all(line.startswith("compiling kernels") for line in done.stderr.splitlines())

    read, write = os.pipe()
    os.close(read)
    done = called("verify", "plan.fits", "--margin", "6", stdout=write)
    os.close(write)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert "BrokenPipe" not in done.stderr


@pytest.mark.slow
def test_runs_where_no_cache_can_be_written(folder):
    nowhere = str(folder / "field.ecsv" / "cache")
    unusable = {"NUMBA_CACHE_DIR": nowhere, "HOME": nowhere, "XDG_CACHE_HOME": nowhere}
    unusable["NUMBA_CACHE_LOCATOR_CLASSES"] = "UserProvidedCacheLocator"  # as if the package's folder were read-only
    done = called("instruments", "hexagonal", stdout=subprocess.PIPE, **unusable)  # which counts neighbours, compiled
    assert done.returncode == 0, done.stderr
    assert "neighbour pairs" in done.stdout
