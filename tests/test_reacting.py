"""Direct plans on which whoever stops dead is touched no sooner than asked for, and says so where it cannot."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import frames_clearance
from fiberplan.planners.direct import first
from fiberplan.planners.direct.contacts import late_contacts
from fiberplan.planners.direct.lattice import make_lattice
from fiberplan.scenes import decisive
from problems import field_to_field


@pytest.fixture(scope="module")
def crowded():
    return field_to_field(0.5, rings=2, seed=3)


@pytest.mark.parametrize("least", [0.3, 0.6])
def test_nobody_is_touched_sooner(crowded, least):
    """The proof of that is of others: clocks off by half as much."""
    plan, late_safe = (fp.planners.Direct(min_reaction=seconds).plan(crowded) for seconds in (None, least))
    assert plan.certificate.tolerates.reaction.seconds < least <= late_safe.certificate.tolerates.reaction.seconds
    assert fp.verify(crowded.plane, late_safe.trajectory, jitter=0.49 * least).ok
    assert late_safe.certificate.ok
    assert late_safe.arrivals == plan.arrivals
    assert not any("stops dead" in note for note in late_safe.notes)


def test_what_is_made_shorter_stays_as_it_was_asked_for():
    """A plan that is late-safe takes longer than anyone needs; shortcuts would know nothing of who is late."""
    asked = field_to_field(1.0, rings=2, seed=0)
    plan = fp.planners.Direct(min_reaction=1.5).plan(asked)
    assert plan.certificate.tolerates.reaction.seconds >= 1.5
    assert plan.makespan > 1.05 * fp.planners.Direct().plan(asked).makespan


def test_a_deadline_that_is_far_off_takes_none_of_it_back(crowded, monkeypatch):
    """The first plan, which knows nothing of who is late, may be the shorter one."""
    monkeypatch.setattr(first, "_LONGER", 1.0)
    without, within = (fp.planners.Direct(min_reaction=3.0).plan(crowded, deadline=end) for end in (None, 3600.0))
    assert within.certificate.tolerates.reaction.seconds >= 3.0
    assert not within.interrupted
    np.testing.assert_array_equal(within.trajectory.angles, without.trajectory.angles)


def test_where_it_cannot_be_had_the_plan_says_so():
    """Two that exchange sides in joint ranges of a second or two cannot leave each other an hour."""
    asked = decisive.exchange()
    plan = fp.planners.Direct(min_reaction=3600.0).plan(asked)
    assert plan.certificate.ok
    assert plan.arrivals == "2 of 2"
    assert plan.notes[-1] == "who stops dead may be touched sooner than 3600 s later: no plan was found where not"
    assert plan.trajectory.duration == fp.planners.Direct().plan(asked).trajectory.duration


@pytest.mark.parametrize("seconds", [0.0, -1.0, np.nan, np.inf])
def test_senseless_times_are_refused(seconds):
    with pytest.raises(fp.ProblemError, match="min_reaction must be positive"):
        fp.planners.Direct(min_reaction=seconds)


@pytest.mark.small
def test_late_contacts_are_those_of_all_nodes_in_time():
    """Against every pair of nodes, looked at one by one."""
    asked = decisive.exchange()
    plane, rng, seen = asked.plane, np.random.default_rng(0), 0
    steps, delay, apart = 30, 3, 0.2
    lattice = make_lattice(plane, asked.start, asked.goal, plane.online, 0.2, steps, np.array([0.2, 0.2]))
    lattice = lattice._replace(delay=delay)
    for _ in range(30):
        turns = np.repeat(rng.normal(0.0, 0.08, (2, steps // 5, 2)) * rng.integers(0, 2, (2, steps // 5, 1)), 5, axis=1)
        lattice.path[:, 1 : steps + 1] = lattice.path[:, :1] + np.cumsum(turns, axis=1)
        at = [[frame(plane.arms, i, *lattice.path[i, k]) for k in range(steps + 1)] for i in (0, 1)]
        expected = sum(
            any(
                frames_clearance(plane.arms, 0, at[0][k], 1, at[1][m]) < apart
                for m in range(max(0, k - delay), min(steps, k + delay) + 1)
            )
            for k in range(steps + 1)
        )
        assert late_contacts(plane.arms, lattice, 0, 1, apart, steps) == expected
        seen += 0 < expected < steps
    assert seen > 3
    assert late_contacts(plane.arms, lattice._replace(delay=0), 0, 1, apart, steps) == 0
