"""Audits of motions that others made: whatever the file, every contact is found, with time and pair."""

import json
import re

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import PlanError, TrajectoryError
from fiberplan.hardware import sdss
from fiberplan.hardware.audit import audit, read_motion
from fiberplan.scenes.uniform import uniform_field
from problems import ARM, SEVEN_PLACES

pytestmark = pytest.mark.small

SEVEN = 'format = 1\nname = "seven"\n' + SEVEN_PLACES + re.sub("speed = .*", "speed = 12", ARM)
GOOD = {
    "R0C2": {"alpha": [[0.0, 1.0], [60.0, 6.0]], "beta": [[180.0, 1.0], [150.0, 4.0], [120.0, 7.0]]},
    "R0C3": {"alpha": [[0.0, 1.0], [200.0, 18.0]], "beta": [[180.0, 1.0], [150.0, 18.0]]},
}
FAST = {"R0C2": {"alpha": [[0.0, 1.0], [60.0, 3.0]], "beta": [[180.0, 1.0], [180.0, 3.0]]}}
TOUCHING = {
    "R0C2": {"alpha": [[0.0, 1.0], [10.0, 2.0], [10.0, 20.0]], "beta": [[180.0, 1.0], [20.0, 15.0], [20.0, 20.0]]},
    "R0C3": {"alpha": [[0.0, 1.0], [180.0, 16.0], [180.0, 20.0]], "beta": [[180.0, 1.0], [20.0, 16.0], [20.0, 20.0]]},
}


@pytest.fixture
def night(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "seven.toml").write_text(SEVEN)
    for name, held in (("good", GOOD), ("fast", FAST), ("touching", TOUCHING)):
        (tmp_path / f"{name}.json").write_text(json.dumps({"trajectory": held}))
    return tmp_path


def test_one_line_a_file(night, capsys):
    assert run(["audit", "seven.toml", "good.json", "--margin", "0.8"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("good.json (sdss): safe: smallest proven clearance 2.4")
    assert "18.000 s" in said
    assert run(["audit", "seven.toml", "good.json", "fast.json", "touching.json", "--margin", "0.8"]) == 1
    _, fast, touching, *_ = capsys.readouterr().out.splitlines()
    assert "positioner 'R0C2': alpha moves at 30 deg/s from 1.000 s, limit 12 deg/s" in fast
    assert "contact: R0C2 and R0C3 at 7.17" in touching
    assert "contact: R0C2 and R+1C2 at 8.28" in touching


def test_json_and_report_say_it_all(night, capsys):
    assert run(["audit", "seven.toml", "touching.json", "good.json", "--margin", "0.8", "--json", "-o", "n.html"]) == 1
    first, second = json.loads(capsys.readouterr().out)["files"]
    assert [contact["pair"] for contact in first["certificate"]["contacts"]] == [["R0C2", "R0C3"], ["R0C2", "R+1C2"]]
    assert second["closest"]["pair"] == "R0C2 and R0C3" or second["closest"]["clearance"] > 2.4
    assert second["lost"] == pytest.approx(18.0 - 200 / 12)
    assert "are not in good.json: taken as folded" in second["certificate"]["assumptions"][-1]
    page = (night / "n.html").read_text()
    assert "1 of 2 files are not proven safe" in page
    assert "contact: R0C2 and R0C3 at 7.17" in page
    assert "http" not in page.replace("http-equiv", "")  # self-contained


def test_what_the_proofs_rest_on_is_said_once(night, capsys):
    plane = fp.FocalPlane.load("seven.toml")
    plane.replace(assumptions=("arms are as drawn",)).write("seven.fits")
    (night / "one.json").write_text(json.dumps({"R0C2": GOOD["R0C2"]}))
    assert run(["audit", "seven.fits", "good.json", "one.json", "--margin", "0.8"]) == 0
    first, second, *rest = capsys.readouterr().out.splitlines()
    assert "notes" not in first + second
    assert rest[0] == "assumed: arms are as drawn"
    assert [line.split(":")[0] for line in rest[1:]] == ["assumed of good.json", "assumed of one.json"]
    assert "R0C3" not in rest[1]
    assert "R0C3" in rest[2]
    assert all("taken as folded" in line for line in rest[1:])


def test_every_motion_has_a_page_to_which_the_report_leads(night, capsys):
    files = ["touching.json", "good.json"]
    assert run(["audit", "seven.toml", *files, "--margin", "0.8", "-o", "n.html", "--pages", "night pages"]) == 1
    assert "wrote 2 pages into night pages" in capsys.readouterr().out
    pages = sorted((night / "night pages").iterdir())
    assert [page.name for page in pages] == ["001-touching.json.html", "002-good.json.html"]
    said = json.loads(re.search(r'id="plan">(.*?)</script>', pages[0].read_text(), re.DOTALL).group(1))["plans"][0]
    assert said["title"] == "touching.json on seven"
    assert said["closest"][0]["pair"] in ([2, 3], [3, 4])
    assert "<a href='night%20pages/001-touching.json.html'>touching.json</a>" in (night / "n.html").read_text()


def test_there_are_no_pages_without_their_report(night, monkeypatch, capsys):
    def full(*what):
        raise PlanError("n.html: no space left")

    monkeypatch.setattr("fiberplan.visuals.night_report.night_report", full)
    options = ["--margin", "0.8", "-o", "n.html", "--pages", "pages"]
    assert run(["audit", "seven.toml", "touching.json", "good.json", *options]) == 2
    assert capsys.readouterr().err == "fiberplan: error: n.html: no space left\n"
    assert list((night / "pages").iterdir()) == []


def test_a_file_that_cannot_be_read_does_not_hide_the_others(night, capsys):
    (night / "bad.json").write_text(json.dumps({"R9C9": GOOD["R0C2"]}))
    assert run(["audit", "seven.toml", "bad.json", "good.json", "--margin", "0.8", "-o", "n.html"]) == 2
    said = capsys.readouterr()
    assert said.err == "fiberplan: error: bad.json: seven has no positioner 'R9C9'; did you mean 'R0C3'?\n"
    assert said.out.startswith("good.json (sdss): safe")
    assert "seven has no positioner &#x27;R9C9&#x27;" in (night / "n.html").read_text()


def test_robots_that_are_left_out_stand_where_the_state_says(night, capsys):
    """R0C3, not in the file, lies across the path of R0C2; its place is known, so nothing is assumed of it."""
    (night / "one.json").write_text(json.dumps({"R0C2": TOUCHING["R0C2"]}))
    (night / "seen.csv").write_text(
        "positioner,alpha,beta\nR0C3,180,20\n"
        + "".join(f"{id_},0,180\n" for id_ in ("R-1C1", "R-1C2", "R0C1", "R0C2", "R+1C1", "R+1C2"))
    )
    assert run(["audit", "seven.toml", "one.json", "--margin", "0.8"]) == 1
    assert "R0C2 and R0C3" not in capsys.readouterr().out
    assert run(["audit", "seven.toml", "one.json", "--margin", "0.8", "--state", "seen.csv", "--json"]) == 1
    proof = json.loads(capsys.readouterr().out)["files"][0]["certificate"]
    assert ["R0C2", "R0C3"] in [contact["pair"] for contact in proof["contacts"]]
    assert not any("folded" in text for text in proof["assumptions"])


TABLE = """# time: s
positioner,time,alpha,beta
R0C2,1,0,180
R0C2,4,,150
R0C2,6,60,
R0C2,7,,120
R0C3,1,0,180
R0C3,18,200,150
"""


def test_a_table_says_the_same_as_a_trajectory(night):
    """Alpha and beta have times of their own where a cell is empty."""
    plane = fp.FocalPlane.load("seven.toml")
    (night / "good.csv").write_text(TABLE)
    kind, told = read_motion("good.csv", plane)
    _, sent = read_motion("good.json", plane)
    assert kind == "table"
    times = np.linspace(0.0, 19.0, 400)
    np.testing.assert_allclose(told.trajectory.sampled(times), sent.trajectory.sampled(times), atol=1e-12)
    assert told.online.tolist() == sent.online.tolist()
    (night / "rad.ecsv").write_text(
        "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: positioner, datatype: string}\n"
        "# - {name: time, unit: ms, datatype: float64}\n# - {name: alpha, unit: rad, datatype: float64}\n"
        "# - {name: beta, unit: rad, datatype: float64}\npositioner time alpha beta\n"
        "R0C2 500 1.5 2.5\nR0C2 900 1.6 2.6\n"
    )
    _, told = read_motion("rad.ecsv", plane)
    i = plane.index["R0C2"]
    assert told.trajectory.knots(i)[0].tolist() == [0.5, 0.9]
    np.testing.assert_allclose(told.trajectory.start[i], [1.5, 2.5])


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("R0C3,18", "R0C9,18", "line 8: seven has no positioner 'R0C9'"),
        ("R0C2,4,", "R0C2,8,", "line 5: time is 6 s, before the 8 s of the row above"),
        ("R0C3,1,0,180", "R0C3,1,,180", None),
        ("200", "x", "line 8: alpha is 'x', not a number"),
        ("R0C3,18", "R0C3,1", "line 8: alpha is elsewhere at 1 s"),
        ("alpha", "a", "no column 'alpha'"),
        ("R0C2,1,", "R0C2,-1,", "line 3: time is -1 s"),
    ],
)
def test_bad_tables_are_one_line(night, before, after, says):
    plane = fp.FocalPlane.load("seven.toml")
    (night / "bad.csv").write_text(TABLE.replace(before, after, 1))
    if says is None:  # alpha from its one knot on
        _, told = read_motion("bad.csv", plane)
        assert np.ptp(told.trajectory.knots(plane.index["R0C3"])[1][:, 0]) == 0
        return
    with pytest.raises(TrajectoryError, match=says) as caught:
        read_motion("bad.csv", plane)
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def planned():
    plane = fp.FocalPlane.hexagonal(2, 22.4, max_speed=np.radians(12.0))
    plan = fp.planners.Direct().plan(fp.Problem(plane, uniform_field(plane, 3, 0.8), uniform_field(plane, 4, 0.8), 0.8))
    assert plan.certificate.ok
    return plan


@pytest.mark.large
@pytest.mark.parametrize("format_", ["ecsv", "sdss"])
def test_our_own_exports_are_safe_and_the_end_is_the_plans(tmp_path, planned, format_):
    path = tmp_path / f"m.{'json' if format_ == 'sdss' else format_}"
    if format_ == "sdss":
        sdss.write(planned, path)
    else:
        fp.io.EXPORTS["ecsv"](planned, path)
    found = audit(planned.problem.plane, path, margin=0.75)
    assert found.certificate.ok
    assert found.bound == pytest.approx(planned.lower_bound)
    np.testing.assert_allclose(found.executed.trajectory.end, planned.trajectory.end, atol=2e-5)


@pytest.mark.parametrize(
    ("held", "says"),
    [
        ({}, "cannot be read as a table (no format that is known)"),
        ({"trajectory": {}}, "names no robot that moves"),
        ({"trajectory": {"R0C2": {"alpha": [[0.0, 0.0]]}}}, "robot R0C2: beta: no points [deg, s]"),
        ([1, 2], "cannot be read as a table (no format that is known)"),
    ],
)
def test_a_file_without_motion_is_not_called_safe(night, held, says):
    (night / "none.json").write_text(json.dumps(held))
    with pytest.raises(TrajectoryError, match=re.escape(says)):
        audit(fp.FocalPlane.load("seven.toml"), "none.json")


def test_a_plan_is_for_verify(night):
    plane = fp.FocalPlane.load("seven.toml")
    goal = np.full((7, 2), np.nan)
    fp.planners.GreedyFold().plan(fp.Problem(plane, plane.folded, goal, 0.8)).write("p.fits")
    with pytest.raises(TrajectoryError, match=r"p\.fits: is a plan, which `fiberplan verify` proves"):
        audit(plane, "p.fits")
