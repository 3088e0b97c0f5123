"""Targets of PFS' cobras: phases that are safe whatever the speeds, and the proof that leaves speeds open."""

from itertools import pairwise

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.certificates.any_speed import contacts_at_any_speed
from fiberplan.errors import PlanError, TrajectoryError, UnprovenError
from fiberplan.hardware import pfs
from fiberplan.hardware.pfs.waiting import without_waiting
from fiberplan.scenes.uniform import uniform_field

pytestmark = pytest.mark.small


@pytest.fixture(scope="module")
def seven():
    """Seven cobras; phi is counted from folded."""
    plane = fp.FocalPlane.hexagonal(1, 8.0, (2.375, 2.375), 0.5, 0.5, lower=(0, 0), upper=(6.6, 3.1), folded=(0, 0))
    return plane.replace(zero=np.tile([0.0, -np.pi], (plane.n, 1)), ids=tuple(str(k + 1) for k in range(plane.n)))


def by_ends(plane, start, end, margin=0.1):
    """A plan whose ends are {cobra: (theta, phi) [deg]}, the others folded; everyone turns evenly."""
    ends = []
    for given in (start, end):
        angles = plane.folded.copy()
        for id_, pose in given.items():
            angles[plane.index[id_]] = np.radians(pose)
        ends.append(angles)
    problem = fp.Problem(plane, *ends, margin)
    motion = fp.Trajectory.from_samples(np.array([0.0, 20.0]), np.array(ends))
    return fp.Plan(problem, motion, (fp.Outcome.ARRIVED,) * plane.n, "by hand")


def any_speeds(plane, begin, end, rng, count=4000):
    """The smallest clearance of configurations in which each joint is anywhere between its ends."""
    smallest = np.inf
    for _ in range(count):
        part = rng.uniform(0.0, 1.0, begin.shape)
        smallest = min(smallest, plane.clearance((1 - part) * begin + part * end).min())
    return smallest


@pytest.mark.large
def test_the_proof_leaves_speeds_open(seven):
    """What random progress of joints finds to touch is found; what is proven clear no progress makes touch."""
    rng = np.random.default_rng(1)
    clear = touching = 0
    for most in np.repeat([1.9, 3.1], 12):
        begin, end = (np.stack([rng.uniform(0, 6.2, 7), rng.uniform(0, most, 7)], axis=1) for _ in range(2))
        end[:, 0] = begin[:, 0] + rng.uniform(-0.8, 0.8, 7)
        found = contacts_at_any_speed(seven, begin, end, 0.1, np.zeros(7))
        sampled = any_speeds(seven, begin, end, rng, 300)
        assert not (sampled < 0.1 and not found)
        clear, touching = clear + (not found), touching + bool(found)
    assert clear >= 2
    assert touching >= 2


def test_in_turn_out(tmp_path, seven):
    """Phi in to 60 deg, theta, phi out: three iterations, proven; the file ends at the plan's end."""
    plan = by_ends(seven, {"3": (20, 120), "4": (200, 60)}, {"3": (140, 100), "4": (90, 150)})
    done = pfs.write(plan, tmp_path / "t.csv", visit=7)
    assert done.facts == {"cobras": 2, "iterations": 3}
    executed = pfs.read(tmp_path / "t.csv", seven, plan.state_at(0.0))
    i = seven.index["3"]
    times, _ = executed.trajectory.knots(i)
    told = [np.degrees(executed.trajectory.at(t)[i]).tolist() for t in times]
    np.testing.assert_allclose(told, [[20, 120], [20, 60], [140, 60], [140, 100]], atol=1e-9)
    first = (tmp_path / "t.csv").read_text().splitlines()[1].split(",")
    assert first[:4] == ["7", "1", "3", "0"]
    assert pfs.accepts(tmp_path / "t.csv", (tmp_path / "t.csv").read_bytes())


def facing(seven):
    """Two goals that are clear, of arms of which one passes the other's place while both turn out."""
    plan = by_ends(seven, {}, {"3": (0, 150), "4": (228, 150)})
    assert len(pfs.iterations(plan, 0.05, np.zeros(7))) == 3
    return plan


def test_who_would_meet_turns_out_one_after_the_other(tmp_path, seven):
    plan = facing(seven)
    done = pfs.write(plan, tmp_path / "t.csv")
    assert done.facts["iterations"] == 3  # theta, one out, the other out: both begin folded
    assert done.certificate.ok


def test_bytes_in_which_both_turn_out_at_once_are_not_left_behind(tmp_path, seven, monkeypatch):
    plan = facing(seven)
    jointly = pfs.iterations(plan, 0.05, np.zeros(7))
    monkeypatch.setattr(pfs, "iterations", lambda *_: [jointly[0], jointly[-1]])
    with pytest.raises(UnprovenError, match=r"not safe: 1 contacts \(margin 0.05 mm\): 3 and 4 at"):
        pfs.write(plan, tmp_path / "t.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("seed", [16, 25, 123])
def test_who_can_turn_out_neither_before_nor_after_another_turns_theta_with_phi_out(tmp_path, seven, seed):
    start, end = (uniform_field(seven, k, 0.1) for k in (2 * seed, 2 * seed + 1))
    motion = fp.Trajectory.from_samples(np.array([0.0, 20.0]), np.array([start, end]))
    plan = fp.Plan(fp.Problem(seven, start, end, 0.1), motion, (fp.Outcome.ARRIVED,) * 7, "by hand")
    done = pfs.write(plan, tmp_path / "t.csv")
    assert done.facts["iterations"] > 3
    places = [start, *pfs.iterations(plan, 0.05, np.zeros(7))]
    assert (places[-1] == end).all()
    for before, after in pairwise(places):
        assert not contacts_at_any_speed(seven, before, after, 0.05, np.zeros(7))
    out = np.array([np.minimum(a[:, 1], b[:, 1]) for a, b in pairwise(places)]) > np.radians(60.0)
    assert (out & (np.diff([place[:, 0] for place in places], axis=0) != 0)).any()


def test_an_elbow_turns_out_of_the_way(tmp_path):
    """Of two cobras one is in already, but its elbow stands where the other would turn phi in."""
    plane = fp.FocalPlane.load("pfs")
    two = plane.subset(np.array([plane.index["978"], plane.index["980"]]), np.array([], np.int64))
    ends = {"978": (169.564, 10.852), "980": (355.103, 177.45)}, {"978": (100.0, 20.0), "980": (241.117, 31.682)}
    done = pfs.write(by_ends(two, *ends), tmp_path / "t.csv")
    assert done.certificate.ok
    first, second = (done.executed.trajectory.at(t) for t in done.executed.trajectory.knots(1)[0][:2])
    assert first[0, 0] != second[0, 0]
    assert first[1, 1] == second[1, 1]


def test_nobody_waits_for_those_far_off(seven):
    """Turns of two that are far apart go at once; neighbours that would meet turn one after the other, in order."""
    two = seven.subset([seven.index[k] for k in ("1", "2")])
    far = two.replace(base=two.base + [[0.0, 0.0], [100.0, 0.0]])
    out = [two.folded.copy() for _ in range(3)]
    for places, who in zip(out, ([], [0], [0, 1]), strict=True):
        places[who] = np.radians([[0.0, 170.0], [180.0, 170.0]])[who]
    assert [len(without_waiting(plane, out, 0.1, np.zeros(2))) for plane in (far, two)] == [1, 2]
    np.testing.assert_array_equal(without_waiting(two, out, 0.1, np.zeros(2)), out[1:])


def test_who_cannot_get_out_is_named(tmp_path, seven):
    pins = [
        fp.Obstacle(f"pin {k}", seven.base[[0]] + 3.6 * np.array([[np.cos(t), np.sin(t)]]), 0.25)
        for k, t in enumerate(np.radians(np.arange(0.0, 360.0, 30.0)))
    ]
    plane = seven.replace(obstacles=tuple(pins))
    with pytest.raises(PlanError, match=rf"positioners '{plane.ids[0]}' cannot turn phi out past each other"):
        pfs.write(by_ends(plane, {}, {plane.ids[0]: (17.5, 175.0)}), tmp_path / "t.csv")


def test_too_many_iterations_are_refused(tmp_path, seven, monkeypatch):
    monkeypatch.setattr("fiberplan.hardware.pfs.encode.MOST_ITERATIONS", 2)
    with pytest.raises(PlanError, match="takes 3 iterations, 2 are made"):
        pfs.write(by_ends(seven, {"3": (20, 120)}, {"3": (140, 100)}), tmp_path / "t.csv")


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("1,99,0,0", "line 2: hexagonal has no positioner '99'"),
        ("1.5,3,0,0", "line 2: iteration is 1.5, expected a whole number"),
        ("1,3,0,0\n1,3,0,1", "line 3: cobra '3' is given twice in iteration 1"),
        ("1,3,x,0", "line 2: theta is 'x', not a number"),
    ],
)
def test_bad_tables_are_one_line(tmp_path, seven, rows, says):
    (tmp_path / "t.csv").write_text(f"iteration,cobra_id,theta [deg],phi [deg]\n{rows}\n")
    with pytest.raises(TrajectoryError, match=says) as caught:
        pfs.read(tmp_path / "t.csv", seven)
    assert "\n" not in str(caught.value)
