"""Every command on two robots, within this process: with the compiler off these run in seconds."""

import json
import re
import signal
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from astropy.table import QTable

import fiberplan as fp
from fiberplan import cli
from fiberplan.cli import app as commands
from fiberplan.cli import completion
from fiberplan.cli.app import run
from fiberplan.kernels.kernel_cache import KernelCache
from fiberplan.motion import Executed
from fiberplan.planners.amending import rerouting
from fiberplan.reproductions import makarem2014
from fiberplan.reproductions.rows import mean, value
from fiberplan.scenes.decisive import row

pytestmark = pytest.mark.small
STEP, TURN = np.radians(5.0), np.radians(30.0)
START = {"P0": (170, 100), "P1": (20, 130)}
FOLDING = ("--start", "start.csv", "--planner", "greedy-fold", "--set", "step=5")
GOAL = {"P0": (150, 120), "P1": (30, 120)}  #: nearer to each other


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Two robots side by side, a start, goals, and a planner of few steps."""
    monkeypatch.chdir(tmp_path)
    row(2).replace(name="two").write("two.fits")
    for name, rows in (("start", START), ("goal", GOAL)):
        table(f"{name}.csv", rows)
    direct, fold = partial(fp.planners.Direct, turn=TURN), partial(fp.planners.GreedyFold, step=STEP)
    for name, planner in (("Direct", direct), ("GreedyFold", fold)):
        monkeypatch.setattr(fp.planners, name, planner)
    monkeypatch.setattr(rerouting, "_TURN", TURN)
    monkeypatch.setattr(rerouting, "_FEWEST_STEPS", 4)
    return tmp_path


def table(name, rows):
    text = "\n".join(",".join(map(str, (id_, *angles))) for id_, angles in rows.items())
    Path(name).write_text(f"positioner,alpha,beta\n{text}\n")


def told(capsys, code, *arguments):
    """What a command prints, which exits so."""
    assert run([str(argument) for argument in arguments]) == code
    out, err = capsys.readouterr()
    return out if code != 2 else err


def planned(capsys, code, *options):
    return told(capsys, code, "plan", "two.fits", "goal.csv", *FOLDING, "--margin", 0.5, *options)


def test_a_plan_from_its_making_to_its_export(folder, capsys):
    out = planned(capsys, 0, "-o", "p.fits", "--page", "p.html")
    assert out.startswith("2 of 2 arrived in ")
    assert out.endswith("wrote p.fits and p.html\n")
    assert (folder / "p.html").read_text().startswith("<!")
    plan = fp.Plan.read("p.fits")
    np.testing.assert_allclose(np.degrees(plan.end.angles), list(GOAL.values()))
    assert told(capsys, 0, "verify", "p.fits").startswith("safe: ")
    assert "not safe" in told(capsys, 1, "verify", "p.fits", "--margin", 60)
    assert told(capsys, 0, "export", "p.fits", "--to", "motions", "-o", "p.ecsv") == "wrote p.ecsv\n"
    moves = QTable.read("p.ecsv")
    assert set(moves["positioner"]) == set(START)
    assert told(capsys, 0, "show", "p.fits", "-o", "again.html") == "wrote again.html\n"
    pages = [(folder / name).read_text() for name in ("p.html", "again.html")]
    assert len({re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d UTC", "DATE", page) for page in pages}) == 1
    assert "reversals of alpha: median 0" in told(capsys, 0, "diagnose", "p.fits")


def test_robots_that_are_switched_off_by_name_or_by_file(folder, capsys):
    (folder / "off.txt").write_text("positioner\nP1  # its motor\n")
    for options in (["P1"], ["off.txt"]):
        out = planned(capsys, 1, "--offline", *options)
        assert "note: offline, as --offline says: P1" in out
        assert out.startswith("1 of 2 arrived")
        assert "lost P1: offline, cannot move" in out
    assert "has no positioner 'P7'" in planned(capsys, 2, "--offline", "P7")
    (folder / "off.txt").write_text("P0\nP7\n")
    assert "off.txt: line 2: two has no positioner 'P7'" in planned(capsys, 2, "--offline", "off.txt")
    assert "--start names its file" in told(capsys, 2, "plan", "two.fits", "goal.csv", "--start-time", 3)


def test_room_for_clocks_and_a_recommended_margin(folder, capsys):
    row(2).replace(name="two", recommended_margin=0.6).write("two.fits")
    out = told(capsys, 0, "plan", "two.fits", "goal.csv", *FOLDING, "--jitter", 0.01)
    assert "note: margin 0.6 mm, as is recommended for two; --margin takes another" in out
    assert "note: clocks that are off by 0.01 s are planned for as arms that are off by up to" in out


def test_one_without_a_target_is_parked(folder, capsys):
    table("one.csv", {"P0": GOAL["P0"]})
    out = told(capsys, 0, "plan", "two.fits", "one.csv", *FOLDING, "--park-idle", "-o", "p.fits")
    assert out.startswith("1 of 1 arrived")
    assert "note: parked: 1 of 1 without a target are folded" in out
    plan = fp.Plan.read("p.fits")
    np.testing.assert_allclose(np.degrees(plan.end.angles[1]), [0, 180], atol=1e-6)
    assert plan.outcomes == (fp.Outcome.ARRIVED, fp.Outcome.NO_TARGET)


def test_instruments(capsys):
    said = json.loads(told(capsys, 0, "instruments", "miradas", "--json"))
    assert (said["positioners"], said["online"], said["bodies"]) == (12, 12, 4)
    out = told(capsys, 0, "instruments", "miradas")
    assert "12" in out
    assert "deg" in out
    assert "miradas" in told(capsys, 0, "instruments")


def test_a_motion_is_proven_on_another_description_of_the_array(folder, capsys):
    planned(capsys, 0, "-o", "p.fits")
    plane = fp.FocalPlane.load("two.fits")
    thick = plane.replace(
        bodies=(fp.Body(plane.bodies[0].points, 15.0),),
        fiber_offsets={"other": plane.fiber},
        obstacles=(fp.Obstacle("post", [[0.0, 90.0]], 1.0),),
        length=plane.length + [0.0, 0.25],
    )
    thick.subset(np.array([1, 0])).write("thick.fits")
    out = told(capsys, 1, "verify", "p.fits", "--instrument", "thick.fits")
    assert "note: the plan's own geometry differs: length of 1 positioners, by 0.25 mm at most (P1)" in out
    fibers = [f"only one has the fiber '{name}'" for name in ("fiber", "other")]
    for words in ("the radius of ", *fibers, "0 obstacles, not 1"):
        assert words in out, words
    plane.subset(np.array([0])).write("less.fits")
    assert "has no positioner P1" in told(capsys, 2, "verify", "p.fits", "--instrument", "less.fits")


def test_goals_are_amended(folder, capsys):
    planned(capsys, 0, "-o", "p.fits")
    told(capsys, 0, "amend", "p.fits", "P1", "--angles", 30, 140, "-o", "q.fits")
    np.testing.assert_allclose(np.degrees(fp.Plan.read("q.fits").end.angles[1]), [30, 140])
    table("new.csv", {"P0": (160, 110)})
    said = json.loads(told(capsys, 0, "amend", "p.fits", "--goals", "new.csv", "--json"))
    assert (said["outcomes"]["ARRIVED"], said["written"]) == (2, [])
    for arguments, text in (
        (["P1", "-99", "0"], "mm from its base, reach"),
        (["P1", "1"], "needs X and Y"),
        (["P1", "1", "2", "--angles", "1", "2"], "not by both"),
        (["P1", "--goals", "new.csv"], "not from both"),
        ([], "whose goal?"),
    ):
        assert text in told(capsys, 2, "amend", "p.fits", *arguments)


@pytest.mark.parametrize("verb", ["fold", "unwind"])
def test_home(folder, capsys, verb):
    out = told(capsys, 0, verb, "two.fits", "--start", "start.csv", "--margin", 0.5, "-o", "home.fits")
    assert out.startswith({"fold": "folding: ", "unwind": "unwinding: "}[verb])
    np.testing.assert_allclose(np.degrees(fp.Plan.read("home.fits").end.angles), [[0, 180]] * 2, atol=1e-6)
    said = json.loads(told(capsys, 0, verb, "two.fits", "--start", "start.csv", "--json"))
    assert (said["planner"], said["written"]) == ({"fold": "direct", "unwind": "greedy-fold"}[verb], [])


def test_two_that_touch_are_parted(folder, capsys):
    touching = {"P0": (0, 30), "P1": (178, 20)}
    table("start.csv", touching)
    assert "P0 and P1 overlap (clearance -" in planned(capsys, 2)
    out = told(capsys, 0, "separate", "two.fits", "--start", "start.csv", "--margin", 0.5, "-o", "apart.fits")
    assert "opening: P0 and P1: begins at -" in out
    assert row(2).clearance(fp.Plan.read("apart.fits").end.angles).min() >= 0.5
    here = np.radians(list(touching.values()))
    row(2).replace(name="two", folded=here, lower=here, upper=here).write("two.fits")
    out = told(capsys, 1, "separate", "two.fits", "--start", "start.csv", "--margin", 0.5)
    assert "wedged P0: in the way: P1" in out
    assert "wedged P1: in the way: P0" in out
    out = told(capsys, 1, "separate", "two.fits", "--start", "start.csv", "--margin", 0.5, "--offline", "P1")
    assert "(offline: P1)" in out


def test_demo(folder, capsys, monkeypatch):
    monkeypatch.setattr(fp.FocalPlane, "load", lambda name: row(2))
    out = told(capsys, 0, "demo", "-o", "here")
    straight, hub, *_ = out.splitlines()
    assert straight.startswith("straight: ")
    assert hub.startswith("by way of folded: ")
    assert "safe: " in out
    plan = fp.Plan.read("here/plan.fits")
    assert (folder / "here" / "plan.html").exists()
    said = json.loads(told(capsys, 0, "demo", "-o", "there", "--json"))
    assert said["written"] == ["there/plan.fits", "there/plan.html"]
    assert said["makespan"] == plan.makespan


def test_warmup(folder, capsys, monkeypatch):
    two = row(2)
    monkeypatch.setattr(fp.FocalPlane, "hexagonal", lambda *size: two)
    monkeypatch.setattr(KernelCache, "lost", 0)
    assert told(capsys, 0, "warmup").startswith("kernels ready in ")
    monkeypatch.setattr(KernelCache, "lost", 1)
    assert run(["warmup"]) == 1
    assert "were compiled but not kept" in capsys.readouterr().err


def test_reproductions_are_shown_beside_the_paper(folder, capsys, monkeypatch):
    rows = [mean("share", 0.25, [1.0, 0.5]), value("time", "about 2", 1.5, 1), value("lost", None, None, 0)]
    asked = []
    monkeypatch.setattr(makarem2014, "run", lambda trials, into: asked.append((trials, into)) or rows)
    out = told(capsys, 0, "reproduce", "makarem2014", "--trials", 2, "-o", "figures")
    assert asked == [(2, Path("figures"))]
    cells = [[cell.strip() for cell in line.split("│")[1:-1]] for line in out.splitlines() if line.startswith("│")]
    assert cells == [["share", "0.25", "0.75 +- 0.35", "2"], ["time", "about 2", "1.5", "1"], ["lost", "", "none", "0"]]
    assert makarem2014.LEGEND.splitlines()[0] in out
    assert json.loads(told(capsys, 0, "reproduce", "makarem2014", "--json")) == rows


def test_what_a_shell_is_offered():
    assert completion.planner_names("gre") == ["greedy-fold"]
    assert completion.instrument_names("sds") == ["sdss"]
    assert completion.formats("mot") == ["motions"]
    assert completion.controller_names("sd") == ["sdss"]
    assert completion.figure_kinds("hist") == ["histogram"]
    named = SimpleNamespace(params={"planner": "greedy-fold"})
    assert completion.setting_keys(named, "m") == ["max_travel="]
    assert completion.setting_keys(SimpleNamespace(params={"planner": "nobody"}), "") == []
    assert "turn=" in completion.setting_keys(SimpleNamespace(params={}), "t")


def test_limits_and_margins_of_an_instrument_are_shown(folder, capsys):
    limits = {"max_acceleration": np.ones((2, 2)), "min_speed": np.full((2, 2), 0.1)}
    row(2).replace(**limits, recommended_margin=0.6).write("limited.fits")
    out = told(capsys, 0, "instruments", "limited.fits")
    for words in ("57.2958 deg/s^2", "5.72958 deg/s", "0.6 mm is recommended"):
        assert words in out, words


def test_a_film_is_as_fast_as_asked_or_lasts_ten_seconds(folder, capsys, monkeypatch):
    planned(capsys, 0, "-o", "p.fits")
    shown = []

    def film(plan, path, fps, speed, size, tell):
        tell(1, 2)
        shown.append((path, fps, speed, size))

    monkeypatch.setattr("fiberplan.visuals.film.animate", film)
    assert told(capsys, 0, "animate", "p.fits", "--speed", 4, "-o", "p.gif") == "wrote p.gif: 4 x real speed\n"
    said = json.loads(told(capsys, 0, "animate", "p.fits", "--size", 300, "-o", "p.mp4", "--json"))
    assert said["written"] == ["p.mp4"]
    assert shown == [(Path("p.gif"), 30.0, 4.0, 1000), (Path("p.mp4"), 30.0, said["speed"], 300)]


def test_what_an_export_does_not_know_is_refused(folder, capsys):
    planned(capsys, 0, "-o", "p.fits")
    for options, text in (
        (["--to", "nothing", "-o", "p.json"], "no export 'nothing'; there are "),
        (["--to", "motions", "--latency", 1, "-o", "p.ecsv"], "--latency: 'motions' has no such option"),
        (["--to", "motions", "-o", "-"], "-: stdout carries the answer in words"),
        (["--to", "motions", "-o", "."], ". is a folder, not a file"),
        (["--to", "motions", "-o", "p.json"], "this command writes an ECSV table, which ends in .ecsv"),
    ):
        assert text in told(capsys, 2, "export", "p.fits", *options)


def test_a_plan_that_is_not_proven_when_executed_is_not_exported(folder, capsys, monkeypatch):
    planned(capsys, 0, "-o", "p.fits")

    def write(plan, path):
        raise fp.UnprovenError("two: executed, P0 and P1 touch")

    monkeypatch.setitem(fp.io.EXPORTS._own, "motions", write)
    assert run(["export", "p.fits", "--to", "motions", "-o", "p.ecsv"]) == 1
    assert "executed, P0 and P1 touch; `fiberplan plan --for motions` plans so" in capsys.readouterr().err


def test_what_was_handed_over_is_told(folder, capsys, monkeypatch):
    """What a controller's writer gives back: facts, what is assumed, and the proof of what is executed."""
    planned(capsys, 0, "-o", "p.fits")

    def write(plan, path):
        executed = Executed(plan.trajectory, np.zeros((2, 2)), 0.0, notes=("rounded",), assumptions=("no wind",))
        return SimpleNamespace(
            facts={"rows": {"P0": 2}, "bytes": 1234}, executed=executed, certificate=plan.certificate
        )

    monkeypatch.setitem(fp.io.EXPORTS._own, "motions", write)
    out = told(capsys, 0, "export", "p.fits", "--to", "motions", "-o", "p.ecsv").splitlines()
    assert out[:4] == ["rows: 2 P0", "bytes: 1,234", "rounded", "assumed: no wind"]
    assert out[4].startswith("read back, executed: safe: ")
    said = json.loads(told(capsys, 0, "export", "p.fits", "--to", "motions", "-o", "p.ecsv", "--json"))
    assert said["facts"] == {"rows": {"P0": 2}, "bytes": 1234}
    assert (said["executed"]["margin"], said["executed"]["notes"]) == (0.5, ["rounded"])


def test_whom_a_table_says_to_switch_off(folder, capsys):
    Path("able.csv").write_text("positioner,online\nP0,1\nP1,0\n")
    assert "offline, as --offline says: P1\n" in planned(capsys, 1, "--offline", "able.csv")
    Path("able.csv").write_text("positioner,online\nP0,1\nP9,0\n")
    for named, text in (
        ("able.csv", "able.csv: line 3: two has no positioner 'P9'"),
        (" , ", "it names nobody"),
        ("none.csv", "--offline none.csv: no such file"),
    ):
        assert text in planned(capsys, 2, "--offline", named)


def test_an_interrupt_before_the_commands_are_there(monkeypatch, capsys):
    class Interrupted:
        def __getattr__(self, name):
            raise KeyboardInterrupt

    monkeypatch.setitem(commands.sys.modules, "fiberplan.cli.app", Interrupted())
    with pytest.raises(SystemExit) as done:
        cli.main()
    assert done.value.code == 130
    assert capsys.readouterr().err == "fiberplan: error: interrupted\n"


def test_an_ended_command_says_so_and_is_not_ended_twice(monkeypatch, capsys):
    set_ = {}
    monkeypatch.setattr(signal, "signal", lambda number, do: set_.update({number: do}))
    monkeypatch.setattr(signal, "getsignal", {signal.SIGTERM: signal.SIG_DFL, signal.SIGHUP: signal.SIG_IGN}.get)
    monkeypatch.setattr(commands.sys, "argv", ["fiberplan", "--version"])
    with pytest.raises(SystemExit) as done:
        cli.main()
    assert done.value.code == 0
    assert capsys.readouterr().out == f"fiberplan {fp.__version__}\n"
    assert set(set_) == {signal.SIGTERM}  # the other one was ignored, as `nohup` has it

    def ended(path):
        set_[signal.SIGTERM](signal.SIGTERM, None)

    monkeypatch.setattr(fp.Plan, "read", ended)
    assert run(["verify", "p.fits"]) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == "fiberplan: error: terminated\n"
    assert set_ == dict.fromkeys(commands.ENDING, signal.SIG_IGN)


def test_interrupts_and_bugs(monkeypatch, capsys):
    for error, code, words in (
        (KeyboardInterrupt(), 130, "interrupted"),
        (OSError(28, "No space left on device", "p.fits"), 2, "p.fits: No space left on device"),
        (KeyError("a bug"), 70, "this is a bug in fiberplan"),
    ):

        def fail(path, error=error):
            raise error

        monkeypatch.setattr(fp.Plan, "read", fail)
        assert run(["verify", "p.fits"]) == code
        assert words in capsys.readouterr().err
    assert run([]) == 0
    assert "Usage: fiberplan" in capsys.readouterr().out


def test_a_terminal_obeys_no_name(folder, capsys):
    """Control characters of ids and cells are shown, not sent, in tables, lines and errors."""
    fp.FocalPlane.load("two.fits").replace(ids=("P\x1b[31m", "P1\x07"), notes=("by\x1b]0;me",)).write("odd.fits")
    Path("odd.csv").write_text("positioner,alpha,beta\nP\x1b[1m,1,2\n")
    for code, *words in ((0, "instruments", "odd.fits"), (2, "plan", "odd.fits", "odd.csv")):
        said = told(capsys, code, *words)
        assert "P\\x1b[" in said
        assert not set("\x1b\x07") & set(said)
