"""Move tables that wait so that power supplies have few moving at once: written, read back, certified."""

import csv
import json

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.cli.app import run
from fiberplan.errors import PlanError
from fiberplan.hardware import desi
from fiberplan.shaping import load

pytestmark = pytest.mark.small

CRUISE = np.radians(59_400 / (46 / 14 + 1) ** 4)


@pytest.fixture(scope="module")
def plan():
    """Four of seven arms of DESI's size turn by 40 deg or more at once, one of them after a while."""
    plane = fp.FocalPlane.hexagonal(1, 10.4, (3.0, 3.0), 1.0, CRUISE, lower=(-3.2, 0.0), upper=(3.2, 3.2))
    plane = plane.replace(aliases=tuple(f"M{5000 + i:05d}" for i in range(plane.n)))
    goal = plane.folded.copy()
    goal[:4, 0] += np.radians([40.0, 60.0, 90.0, 120.0])
    knots = [(i, t, *plane.folded[i]) for i in range(7) for t in ([0.0] if i else [0.0, 0.3])]
    knots += [(i, 0.3 + 1.2 * (i + 1) / 4, *goal[i]) for i in range(4)]
    owner, times, theta, phi = np.array(knots, float).T
    motion = fp.Trajectory.from_knots(owner.astype(int), times, np.stack([theta, phi], axis=1), 7)
    return fp.Plan(fp.Problem(plane, motion.start, motion.end), motion, (fp.Outcome.ARRIVED,) * 7, "by hand")


@pytest.fixture
def calibration(tmp_path):
    """A focal-plane file of which only motors are read: three of the four on a bus of V1, one linear, one on V2."""
    rows = ["DEVICE_ID BUS_ID CAN_ID LINPHI PETAL_LOC"]
    rows += [f"M{5000 + i:05d} {36 if i == 3 else 30} {i} {i == 2} 4" for i in range(6)]
    head = "# %ECSV 1.0\n# ---\n# datatype:\n"
    head += "".join(f"# - {{name: {name}, datatype: string}}\n" for name in rows[0].split())
    (tmp_path / "fp-made-up.ecsv").write_text(head + "\n".join(rows) + "\n")
    return tmp_path


def supplies_of(plan, calibration):
    known = desi.motors_of(calibration).supplies
    return [known.get(alias, "none") for alias in plan.problem.plane.aliases]


def test_supplies_by_bus(shared_data):
    found = desi.motors_of(shared_data / "desi").supplies
    buses = desi.motors_of(shared_data / "desi").buses
    assert set(found.values()) == {f"petal {petal} V{k}" for petal in range(10) for k in (1, 2)}
    first = {bus for posid, (_, bus) in buses.items() if found[posid].endswith("V1")}
    assert first == {f"can{bus}" for bus in (30, 31, 32, 33, 34, 35, 39, 40, 41, 42)}


def test_what_is_read_back_keeps_the_share(tmp_path, plan, calibration):
    made = {}
    for power in (None, 0.5):
        path = tmp_path / f"{power}.csv"
        made[power] = desi.write(plan, path, calibration=calibration, power=power)
        executed = desi.read(path, plan.problem.plane, plan.state_at(0.0), linear=["M05002"])
        assert made[power].certificate.ok
        found = load(executed.trajectory, supplies_of(plan, calibration))
        assert found["petal 4 V1"] == pytest.approx(1.0 if power is None else 1 / 3)
        assert found["petal 4 V2"] == 1.0  # of one
        np.testing.assert_allclose(executed.trajectory.end, plan.trajectory.end, atol=1e-4)
    facts = made[0.5].facts
    assert facts[desi.MOST] == {"petal 4 V1": 0.333, "petal 4 V2": 1.0}
    assert facts["wait for power"] == 2
    assert facts["seconds longer than the plan"] > made[None].facts["seconds longer than the plan"] + 2.0
    with (tmp_path / "0.5.csv").open() as file:
        waits = {row["posid"]: json.loads(row["postpause"])[0] for row in csv.DictReader(file)}
        assert sum(wait > 1000 for wait in waits.values()) == 2


def test_share_and_supplies_that_are_missing_are_one_line(tmp_path, plan, calibration):
    for power, file, says in (
        (0.5, None, "M05000 moves, and no calibration names its bus: its power supply is not known"),
        (0.0, calibration, "power must be a share above 0 and at most 1, got 0"),
        (2.0, calibration, "power must be a share above 0 and at most 1, got 2"),
    ):
        with pytest.raises(PlanError, match=says):
            desi.write(plan, tmp_path / "t.csv", calibration=file, power=power)
    assert not (tmp_path / "t.csv").exists()


def test_the_command_exports_with_power(tmp_path, capsys, plan, calibration):
    plan.write(tmp_path / "p.fits")
    options = ["--calibration", str(calibration), "--power", "0.5"]
    assert run(["export", str(tmp_path / "p.fits"), "--to", "desi", "-o", str(tmp_path / "t.csv"), *options]) == 0
    said = capsys.readouterr().out
    assert "wait for power: 2" in said
    assert f"{desi.MOST}: 0.333 petal 4 V1, 1.0 petal 4 V2" in " ".join(said.split())
    assert run(["export", str(tmp_path / "p.fits"), "--to", "sdss", "-o", str(tmp_path / "t.json"), *options[2:]]) == 2
    assert "--power: 'sdss' has no such option" in capsys.readouterr().err
