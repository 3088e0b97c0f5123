"""Other instances of the kinds of trouble that were reported from the field, through the command line."""

import gzip
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from astropy.table import Table

import fiberplan as fp
from fiberplan.cli.app import run

HEAD = "positioner,alpha,beta"
GOOD = "R0C2,100,90"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Seven robots at 12 deg/s."""
    monkeypatch.chdir(tmp_path)
    fp.FocalPlane.hexagonal(1, 22.4, max_speed=np.radians(12.0), name="seven").write("seven.fits")


def planned(capsys, text, *options):
    """Exit code of `plan` on a table, and what it prints."""
    Path("t.csv").write_text(text)
    code = run(["plan", "seven.fits", "t.csv", "--margin", "0.8", *options])
    return code, "".join(capsys.readouterr())


@pytest.mark.parametrize(
    ("head", "row", "said", "code"),
    [
        (f"{HEAD},parity", "R0C3,10,20,up", "parity is 'up', not a number; its target is lost", 1),
        (f"{HEAD},parity", "R0C3,10,20,2", "parity is 2, expected +1", 1),
        (f"{HEAD},priority", "R0C3,10,20,-1", "priority is -1, expected a finite number of 0 or more; its", 1),
        (f"{HEAD},assigned", "R0C3,10,20,maybe", "assigned is 'maybe', neither true nor false", 1),
        (f"{HEAD},fiber", "R0C3,10,20,apogee", "seven has no fiber 'apogee'; it has fiber; its target is lost", 1),
        (f"{HEAD},x,y", "R0C3,10,,5,5", "beta is empty, and only the other angle is given; its target is lost", 1),
        (HEAD, "unassigned,10,20", "seven has no positioner 'unassigned'", 1),
        (HEAD, "R0C2,20,20", "positioner 'R0C2' already has a target in line 2", 1),
        (HEAD, "R0C3,,", "alpha is empty and beta is empty", 0),
    ],
)
def test_one_bad_row_is_dropped_by_name_and_the_rest_planned(capsys, head, row, said, code):
    good = GOOD + ",1" * head.endswith("priority") + "," * (head.count(",") - 2 - head.endswith("priority"))
    text = f"{head}\n{good}\n{row}\n"
    refused, line = planned(capsys, text)
    assert refused == 2
    assert len(line.splitlines()) == 1
    assert "line 3" in line
    got, out = planned(capsys, text, "--conflicts", "drop")
    assert got == code, out
    assert out.startswith("1 of 1 arrived")
    assert f"line 3 of t.csv was left out: {said}" in out
    assert ("1: left out of the table" if code else "losses        none") in out


def test_who_may_be_disabled_is_not_moved(capsys):
    text = f"{HEAD},disabled\n{GOOD},0\nR0C3,200,120,maybe\n"
    refused, line = planned(capsys, text)
    assert refused == 2
    assert "line 3: disabled is 'maybe'" in line
    code, out = planned(capsys, text, "--conflicts", "drop", "-o", "p.fits")
    assert code == 0
    assert "line 3 of t.csv: disabled is 'maybe', neither true nor false: taken as disabled" in out
    plan = fp.Plan.read("p.fits")
    np.testing.assert_allclose(np.degrees(plan["R0C3"].start), [200, 120])
    assert plan["R0C3"].outcome is fp.Outcome.OFFLINE


def test_two_columns_that_differ_only_in_case_are_refused(capsys):
    code, line = planned(capsys, f"{HEAD},Alpha\n{GOOD},5\n")
    assert code == 2
    assert "columns 'alpha' and 'Alpha' differ only in their case" in line


def test_a_row_that_disagrees_is_no_robot_of_unknown_place(capsys):
    """What a plan says of rows whose angles and place disagree stands apart from what it says of guesses."""
    plane = fp.FocalPlane.load("seven.fits")
    x, y = plane.fibers(np.radians(np.tile([100.0, 90.0], (7, 1)))).T
    x[plane.index["R0C3"]] += 3.0
    text = f"{HEAD},x [cm],y [cm]\n"
    text += "".join(f"{id_},100,90,{x[i] / 10},{y[i] / 10}\n" for i, id_ in enumerate(plane.ids) if id_[:2] == "R0")
    code, out = planned(capsys, text)
    assert code == 0
    assert "assumed: angles and position disagree by more than 1 mm: R0C3 in line 4 3.000 mm" in out
    assert "stands where it is taken to stand" not in out


def test_a_table_says_who_is_offline(capsys):
    Path("off.csv").write_text("positioner,why\nR0C3,broken\nR0C1,since yesterday\n")
    code, out = planned(capsys, f"{HEAD}\n{GOOD}\n", "--offline", "off.csv")
    assert code == 0
    assert "offline, as --offline says: R0C1, R0C3" in out
    Path("off.csv").write_text("positioner,why\nR0C9,broken\n")
    code, out = planned(capsys, f"{HEAD}\n{GOOD}\n", "--offline", "off.csv")
    assert code == 2
    assert "off.csv: line 2: seven has no positioner 'R0C9'" in out


def test_a_table_that_says_who_is_online_switches_the_others_off(capsys):
    """Such as a state that a simulation wrote, in any format; a file that there is not is called that."""
    Path("off.csv").write_text("positioner,online\nR0C1,1\nR0C3,0\n")
    table = Table({"positioner": ["R0C1", "R0C3"], "online": [True, False]})
    table.write("off.ecsv")
    table.write("off.fits")
    for name in ("off.csv", "off.ecsv", "off.fits"):
        code, out = planned(capsys, f"{HEAD}\n{GOOD}\n", "--offline", name)
        assert code == 0
        assert "offline, as --offline says: R0C3\n" in out
    code, out = planned(capsys, f"{HEAD}\n{GOOD}\n", "--offline", " ,")
    assert code == 2
    assert "--offline ' ,': it names nobody" in out
    for name in ("off.ecsv", "gone.csv"):
        Path(name).unlink(missing_ok=True)
        code, out = planned(capsys, f"{HEAD}\n{GOOD}\n", "--offline", name)
        assert code == 2
        assert f"--offline {name}: no such file" in out


def test_numbers_of_robots_may_be_written_as_floats(capsys):
    """So a column of numbers comes out of a program in which one of them was missing."""
    plane = fp.FocalPlane.load("seven.fits")
    plane.replace(aliases=tuple(str(11 + k) for k in range(7))).write("seven.fits")
    number = 11 + plane.index["R0C2"]
    Path("seen.csv").write_text(f"{HEAD}\n" + "".join(f"{11 + k}.0,0,180\n" for k in range(7)))
    code, out = planned(capsys, f"{HEAD}\n{number}.0,100,90\n", "--start", "seen.csv")
    assert code == 0, out
    assert out.startswith("1 of 1 arrived")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--margin", "1e308"], "margin is 1e+308 mm, more than the 4e+09 mm that can be computed with"),
        (["--position-error", "1e300"], "position error must be one length or 7, of 0 to 4e+09 mm"),
        (["--jitter", "1e308"], "--jitter 1e+308: arms could be off by more than 4e+09 mm by then"),
    ],
)
def test_lengths_that_no_proof_could_be_about_are_refused(capsys, options, said):
    """Such a start was called one that only comes apart: at -1e308 mm nothing changes a clearance."""
    code, line = planned(capsys, f"{HEAD}\n{GOOD}\n", *options)
    assert (code, line) == (2, f"fiberplan: error: {said}\n")
    assert planned(capsys, f"{HEAD}\n{GOOD}\n", "-o", "p.fits")[0] == 0
    assert run(["verify", "p.fits", *options]) == 2


def test_a_target_at_the_end_of_the_world_is_out_of_reach_in_one_line(capsys):
    code, line = planned(capsys, "positioner,x,y\nR0C2,1e308,0\n")
    assert code == 2
    assert len(line) < 250
    assert "its target in line 2 is 1e+308 mm from its base" in line


def test_a_motor_that_turns_no_slower_than_that_is_planned_for(capsys):
    """Going to the target together, beta would turn at 10.8 deg/s."""
    limited = fp.FocalPlane.load("seven.fits").replace(min_speed=np.radians(np.full((7, 2), 11.5)))
    limited.write("seven.fits")
    code, out = planned(capsys, f"{HEAD}\n{GOOD}\n", "-o", "p.fits")
    assert code == 0, out
    assert "shaped for its motors" in out
    assert run(["verify", "p.fits"]) == 0
    motion = fp.Plan.read("p.fits").trajectory
    same = np.diff(motion.owner) == 0
    turns, spans = np.abs(np.degrees(np.diff(motion.angles, axis=0)))[same], np.diff(motion.times)[same]
    assert np.all((turns < 1e-6) | (turns >= 11.5 * (1 - 1e-9) * spans[:, None]))


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("far.csv", "target,x,y\na,1e308,12\nb,14,12\n", "far.csv: line 2: x is 1e+308 mm, more than 4e+09"),
        ("p.csv", "target,x,y,priority\na,14,12,1e308\n", "p.csv: line 2: priority is 1e+308, expected at most 1e+12"),
        ("p.fits", "", "p.fits: is a plan, not a table of targets"),
    ],
)
def test_catalogues_that_cannot_be_meant_are_refused_in_one_line(capsys, name, text, said):
    if text:
        Path(name).write_text(text)
    else:
        planned(capsys, f"{HEAD}\n{GOOD}\n", "-o", name)
    for command in (["allocate", "seven.fits", name, "-o", "a.ecsv"], ["plan", "seven.fits", name])[: 1 + (not text)]:
        assert run([*command, "--margin", "0.8"]) == 2
        assert capsys.readouterr().err == f"fiberplan: error: {said}\n"
    assert not Path("a.ecsv").exists()


def test_a_motion_that_lasts_for_ever_is_refused(capsys):
    sent = {"R0C2": {"alpha": [[0, 0], [60, 1e308]], "beta": [[180, 1]]}}
    Path("sent.json").write_text(json.dumps({"trajectory": sent}))
    for command in ("audit", "simulate"):
        assert run([command, "seven.fits", "sent.json"]) == 2
        said = capsys.readouterr().err
        assert "knot at 1e+308 s" in said
        assert len(said) < 200


def test_letters_of_a_locale_without_them(monkeypatch):
    """There stdout would pass on what it was not told to escape, and files would be read in the locale's letters."""
    names = tuple(f"\N{SNOWMAN}{k}" for k in range(7))
    fp.FocalPlane.load("seven.fits").replace(ids=names).write("seven.fits")
    rows = "".join(f"{name} {t} 0.0 180.0\n" for name in names for t in (0.0, 1.0))
    head = "".join(f"# - {{name: {name}, datatype: float64}}\n" for name in ("time", "alpha", "beta"))
    head = f"# %ECSV 1.0\n# ---\n# datatype:\n# - {{name: positioner, datatype: string}}\n{head}"
    Path("still.ecsv").write_text(f"{head}positioner time alpha beta\n{rows}", encoding="utf-8")
    for name, value in {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}.items():
        monkeypatch.setenv(name, value)
    done = subprocess.run(
        [sys.executable, "-m", "fiberplan", "audit", "seven.fits", "still.ecsv"], capture_output=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"closest \u26033 and \u26034" in done.stdout


@pytest.mark.parametrize("name", ["seven.toml", "robots.csv"])
def test_an_instrument_that_gzip_packed(capsys, name):
    text = {
        "seven.toml": (Path(fp.__file__).parent / "instruments" / "builtin" / "pfs.toml").read_text(),
        "robots.csv": "positioner,x,y,length,fiber_x,alpha_lower,alpha_upper,beta_lower,beta_upper\n"
        "A,0,0,3.0,3.1,-190,190,-5,185\n",
    }[name].encode()
    Path(name).write_bytes(text)
    Path(f"{name}.gz").write_bytes(gzip.compress(text))
    Path(f"cut.{name}.gz").write_bytes(gzip.compress(text)[:-9])
    plain, packed = (fp.FocalPlane.load(each) for each in (name, f"{name}.gz"))
    assert packed.name == plain.name
    assert packed.ids == plain.ids
    assert run(["instruments", f"cut.{name}.gz"]) == 2
    assert capsys.readouterr().err.endswith("is truncated: it ends before what it packs does\n")


def test_more_obstacles_than_positioners(capsys):
    """As in a small field of MOONS among its datum switches: the closest pair had the number of an obstacle."""
    plane = fp.FocalPlane.load("seven.fits")
    around = [20.0 * np.array([[np.cos(t), np.sin(t)]]) for t in np.arange(4.0)]
    pins = tuple(fp.Obstacle(f"pin {k}", place, 1.0) for k, place in enumerate(around))
    only = plane.subset([plane.index["R0C2"]])
    only.replace(obstacles=pins).write("seven.fits")
    code, out = planned(capsys, f"{HEAD}\n{GOOD}\n")
    assert code == 0, out
    assert "closest pair  R0C2 and obstacle pin " in out, out
