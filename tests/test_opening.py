"""Starts nearer than the margin: every planner opens them first, and the proof sees each one that does not open."""

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome
from fiberplan.planners.separating import separate
from fiberplan.scenes.decisive import few
from fiberplan.scenes.uniform import uniform_field
from problems import hexagon
from references import clearance_over_time, looks, motion_of

MARGIN = 0.8
PLANNERS = ["greedy-fold", "prioritized-roadmap", "navigation-function", "direct"]


def made_by(problem, planner="direct"):
    return fp.planners.PLANNERS[planner]().plan(problem)


def seven(beta_left=29.9, beta_right=29.9):
    """Seven robots; the one in the middle reaches to the right, its neighbour there to the left."""
    plane = hexagon(1, upper=np.radians([360.0, 180.0]), max_speed=np.radians(12.0))
    start = plane.folded.copy()
    middle = int(np.argmin(np.linalg.norm(plane.base, axis=1)))
    right = int(np.argmin(np.linalg.norm(plane.base - [22.4, 0.0], axis=1)))
    start[middle], start[right] = np.radians([0.0, beta_left]), np.radians([180.0, beta_right])
    return plane, start, (min(middle, right), max(middle, right))


def gap_of(plane, angles, pair):
    i, j = pair
    still = Trajectory.at_rest(angles)
    return float(clearance_over_time(plane, still, i, j, np.zeros(1))[0])


def near():
    plane, start, pair = seven()
    assert 0.7 < gap_of(plane, start, pair) < MARGIN, "the scene is not near"
    return plane, start, pair


def touching_scene():
    plane, start, pair = seven(20.0, 20.0)
    assert gap_of(plane, start, pair) <= 0.0, "the scene does not touch"
    return plane, start, pair


def problem_of(scene, seed=5, **others):
    plane, start, _ = scene
    others = {"near_start": "open", "conflicts": "drop"} | others
    return fp.Problem(plane, start, uniform_field(plane, seed, MARGIN), MARGIN, **others)


def assert_only_opens(plan, pair):
    """By shapely: the pair never comes nearer than it began until it has the margin, and everyone else keeps it."""
    plane, motion = plan.problem.plane, plan.trajectory
    for i, j in plane.arm_pairs_within(MARGIN + 1.0):
        if j >= plane.n:
            continue
        gaps = clearance_over_time(plane, motion, i, j, looks(motion, i, j, 1500))
        if (i, j) != pair:
            assert gaps.min() >= MARGIN - 1e-9, (i, j)
            continue
        open_ = np.flatnonzero(gaps >= MARGIN)
        assert len(open_), "never opened"
        assert gaps[: open_[0]].min() >= min(gaps[0], MARGIN) - 1e-6, "came nearer first"
        assert gaps[open_[0] :].min() >= MARGIN - 1e-9, "came near again"


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("scene", [near, touching_scene])
def test_every_planner_opens_the_start_first(planner, scene):
    plane, start, pair = made = scene()
    plan = made_by(problem_of(made), planner=planner)
    certificate = plan.certificate
    assert certificate.ok, str(certificate)
    (opening,) = certificate.opening
    assert opening.pair == pair
    assert 0 < opening.time < plan.makespan
    if scene is near:
        assert opening.clearance == pytest.approx(gap_of(plane, start, pair), abs=1e-6)
    else:
        assert opening.clearance < 0, "an overlap has a clearance below 0"
    assert sum(o is fp.Outcome.ARRIVED for o in plan.outcomes) == plan.problem.has_goal.sum() > 0
    assert_only_opens(plan, pair)
    assert any("opened first" in note for note in plan.notes)


def test_proof_without_leave_to_open_still_fails():
    made = near()
    plan = made_by(problem_of(made))
    certificate = fp.verify(made[0], plan.trajectory, MARGIN)
    assert not certificate.ok
    assert [c.pair for c in certificate.contacts] == [made[2]]


@pytest.mark.small
def test_refused_unless_asked_and_the_line_tells_the_way_out():
    with pytest.raises(ProblemError) as refused:
        problem_of(near(), near_start="raise")
    assert "overlap" not in str(refused.value), "nothing overlaps above 0 mm"
    assert "0.7" in str(refused.value)
    assert "0.8" in str(refused.value)
    with pytest.raises(ProblemError, match="overlap"):
        problem_of(touching_scene(), near_start="raise")


def opening_by(scene, *betas, back=None):
    """The pair's betas go through `betas` [deg], five seconds each; everyone else stands."""
    plane, start, (i, j) = scene
    knots = []
    for arm in range(plane.n):
        points = [(0.0, *start[arm])]
        if arm in (i, j):
            points += [(5.0 * (k + 1), start[arm, 0], np.radians(b)) for k, b in enumerate(betas)]
        knots.append(points)
    return plane, motion_of(*knots)


@pytest.mark.parametrize(
    ("betas", "fine"),
    [
        ((32.0, 40.0), True),
        ((29.9, 40.0), True),
        ((29.9,), True),  # stays where it is: comes no nearer
        ((29.89, 40.0), False),  # 0.003 mm nearer first
        ((29.0, 40.0), False),
        ((40.0, 29.95), False),  # had the margin, and lost it again
        ((40.0, 29.9), False),
        ((40.0, 29.0, 40.0), False),
    ],
)
def test_proof_of_a_near_pair(betas, fine):
    plane, motion = opening_by(near(), *betas)
    certificate = fp.verify(plane, motion, MARGIN, opening=True)
    assert certificate.ok is fine, str(certificate)
    assert len(certificate.opening) == fine


@pytest.mark.parametrize(
    ("betas", "fine"), [((21.0, 45.0), True), ((19.0, 45.0), False), ((25.0, 24.0, 45.0), True), ((10.0,), False)]
)
def test_proof_of_a_pair_that_overlaps(betas, fine):
    """Only what it had at the beginning counts: deeper is refused, deeper than a moment ago is not."""
    plane, motion = opening_by(touching_scene(), *betas)
    assert fp.verify(plane, motion, MARGIN, opening=True).ok is fine


def test_planted_dips_are_all_found():
    """Ever smaller dips at any moment of an opening, down to a hundred times the tolerance of the proof."""
    _, _, (i, j) = near()
    rng = np.random.default_rng(2)
    for _ in range(60):
        dip = 10.0 ** rng.uniform(-3.5, 0)  # [deg] further in than the start
        first = 29.9 + rng.uniform(0.0, 0.1) * rng.integers(0, 2)
        plane, motion = opening_by(near(), first, 29.9 - dip, 29.9, 50.0)
        times = np.linspace(0, motion.duration, 4001)
        gaps = clearance_over_time(plane, motion, i, j, times)
        assert gaps.min() < gaps[0] - 1e-6, "the dip is none"
        assert not fp.verify(plane, motion, MARGIN, opening=True).ok, dip


@pytest.mark.parametrize("seed", range(12))
def test_no_random_motion_is_accepted_that_shapely_refuses(seed):
    plane, start, (i, j) = near()
    rng = np.random.default_rng(seed)
    accepted = 0
    for _ in range(25):
        turns = np.radians(rng.uniform(-0.4, 1.0, (3, 2, 2)))
        knots = [[(0.0, *start[arm])] for arm in range(plane.n)]
        for arm, side in ((i, 0), (j, 1)):
            at = start[arm]
            for k in range(3):
                at = np.clip(at + turns[k, side], plane.lower[arm], plane.upper[arm])
                knots[arm].append((k + 1.0, *at))
        motion = motion_of(*knots)
        certificate = fp.verify(plane, motion, MARGIN, opening=True)
        gaps = clearance_over_time(plane, motion, i, j, np.linspace(0, motion.duration, 3001))
        first_open = np.flatnonzero(gaps >= MARGIN)
        until = first_open[0] if len(first_open) else len(gaps)
        good = gaps[:until].min(initial=np.inf) >= gaps[0] - 1e-9 and gaps[until:].min(initial=np.inf) >= MARGIN - 1e-9
        pair_ok = (i, j) not in [c.pair for c in (*certificate.contacts, *certificate.undecided)]
        assert good or not pair_ok
        accepted += pair_ok
    assert accepted, "the test would pass if everything were refused"


def test_position_errors_and_jitter_weigh_on_an_opening():
    plane, motion = opening_by(near(), 32.0, 45.0)
    plain = fp.verify(plane, motion, MARGIN, opening=True)
    assert plain.ok
    error = np.zeros(plane.n)
    error[list(near()[2])] = 0.02
    allowed = fp.verify(plane, motion, MARGIN, opening=True, position_error=error)
    assert allowed.ok
    assert allowed.opening[0].clearance == pytest.approx(plain.opening[0].clearance - 0.04, abs=1e-6)
    assert allowed.opening[0].time > plain.opening[0].time


def test_near_an_obstacle():
    plane = hexagon(0, upper=np.radians([360.0, 180.0]))
    post = Obstacle("post", [[17.8, 0.0]], 0.7)
    plane = plane.replace(obstacles=(post,))
    reach = None
    for beta in np.arange(80.0, 0.0, -0.05):  # turned in until it stands nearer than the margin
        start = np.radians([[0.0, beta]])
        try:
            fp.Problem(plane, start, [[np.nan, np.nan]], MARGIN)
        except ProblemError:
            reach = beta
            break
    assert reach is not None
    goal = np.radians([[180.0, 60.0]])
    plan = made_by(fp.Problem(plane, start, goal, MARGIN, near_start="open"))
    certificate = plan.certificate
    assert certificate.ok
    assert certificate.opening[0].pair == (0, -1)
    assert plan.outcomes == (fp.Outcome.ARRIVED,)


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_joint_a_little_out_of_range_comes_back(planner):
    plane = hexagon(1)
    start = plane.folded.copy()
    start[2, 1] = plane.upper[2, 1] + np.radians(0.1)
    problem = fp.Problem(plane, start, uniform_field(plane, 3, 0.0), 0.0, near_start="open")
    plan = made_by(problem, planner=planner)
    assert plan.certificate.ok, str(plan.certificate)
    assert plan.trajectory.angles[plan.trajectory.offsets[2], 1] == start[2, 1]
    assert all(o is fp.Outcome.ARRIVED for o in plan.outcomes)


@pytest.mark.small
def test_far_out_of_range_is_refused():
    plane = hexagon(1)
    start = plane.folded.copy()
    start[2, 1] = plane.upper[2, 1] + np.radians(5.0)
    with pytest.raises(ProblemError, match="outside"):
        fp.Problem(plane, start, np.full((plane.n, 2), np.nan), near_start="open")


class TestSeparate:
    def test_only_the_two_move(self):
        plane, start, pair = touching_scene()
        plan = separate(plane, start, MARGIN)
        assert plan.certificate.ok
        assert_only_opens(plan, pair)
        moved = {i for i in range(plane.n) if np.ptp(plan.trajectory.sampled([0.0, plan.makespan])[i], axis=0).any()}
        assert moved <= set(pair)
        assert moved

    @pytest.mark.small
    def test_nothing_to_do(self):
        plane = hexagon(1)
        plan = separate(plane, plane.folded, MARGIN)
        assert plan.makespan == 0
        assert plan.certificate.ok

    def test_one_that_cannot_move_is_left(self):
        plane, start, (i, j) = touching_scene()
        online = plane.online.copy()
        online[i] = False
        plan = separate(plane.replace(online=online), start, MARGIN)
        assert plan.certificate.ok
        assert plan.outcomes[i] is fp.Outcome.OFFLINE
        assert_only_opens(plan, (i, j))

    @pytest.mark.small
    def test_wedged_is_named_with_what_is_in_the_way(self):
        """Both beta joints cannot turn, nor alpha: nothing parts the two."""
        plane, start, (i, j) = touching_scene()
        lower, upper = plane.lower.copy(), plane.upper.copy()
        lower[[i, j]], upper[[i, j]] = start[[i, j]], start[[i, j]]
        plan = separate(plane.replace(lower=lower, upper=upper, folded=start), start, MARGIN)
        assert plan.outcomes[i] is plan.outcomes[j] is fp.Outcome.DEADLOCKED
        assert plan.blockers[i] == (j,)
        assert plan.blockers[j] == (i,)
        assert plan.makespan == 0

    @pytest.mark.parametrize("planner", PLANNERS)
    def test_wedged_does_not_stop_the_others(self, planner):
        plane, start, (i, j) = touching_scene()
        lower, upper = plane.lower.copy(), plane.upper.copy()
        lower[[i, j]], upper[[i, j]] = start[[i, j]], start[[i, j]]
        plane = plane.replace(lower=lower, upper=upper, folded=start)
        goal = uniform_field(hexagon(1, upper=np.radians([360.0, 180.0])), 5, MARGIN).copy()
        goal[[i, j]] = np.nan
        plan = made_by(fp.Problem(plane, start, goal, MARGIN, conflicts="drop", near_start="open"), planner=planner)
        certificate = plan.certificate
        assert certificate.ok, str(certificate)
        kept = plan.problem.has_goal
        assert kept.sum() >= 3
        assert all(plan.outcomes[k] is fp.Outcome.ARRIVED for k in np.flatnonzero(kept))
        assert (i, j) in [o.pair for o in certificate.opening]
        assert all(np.isinf(o.time) for o in certificate.opening if o.pair == (i, j))


@pytest.mark.parametrize(("planner", "seed"), [("greedy-fold", 0), ("direct", 0), ("direct", 1), ("direct", 2)])
def test_ends_that_are_a_little_off(planner, seed):
    """The next field begins where controllers left the arms: 0.3 deg from where they were sent."""
    plane = hexagon(3)
    rng = np.random.default_rng(seed)
    first = uniform_field(plane, seed, 0.5)
    off = np.clip(first + np.radians(rng.uniform(-0.3, 0.3, first.shape)), plane.lower, plane.upper)
    problem = fp.Problem(plane, off, uniform_field(plane, seed + 50, 0.5), 0.5, near_start="open")
    plan = made_by(problem, planner=planner)
    certificate = plan.certificate
    assert certificate.ok, str(certificate)
    if planner == "direct":
        assert all(o is fp.Outcome.ARRIVED for o in plan.outcomes)


def test_same_plan_twice():
    plans = [made_by(problem_of(touching_scene())) for _ in range(2)]
    assert np.array_equal(plans[0].trajectory.times, plans[1].trajectory.times)
    assert np.array_equal(plans[0].trajectory.angles, plans[1].trajectory.angles)


def test_outlines_without_radius_that_overlap_are_seen():
    """Two plates of no radius that cross: their distance is 0, as at a margin of 0 it may be, but they overlap."""
    plate = [[0.0, -1.0], [15.0, -1.0], [15.0, 1.0], [0.0, 1.0]]
    plane = hexagon(1, bodies=(Body(np.array(plate), 0.0, closed=True),))
    _, start, (i, j) = seven(5.0, 5.0)
    with pytest.raises(ProblemError, match=r"overlap \(clearance -1\."):
        fp.Problem(plane, start, np.full((plane.n, 2), np.nan))
    still = Trajectory.at_rest(start)
    assert [c.pair for c in (*fp.verify(plane, still).contacts, *fp.verify(plane, still).undecided)] == [(i, j)]
    plan = made_by(fp.Problem(plane, start, np.full((plane.n, 2), np.nan), near_start="open"))
    assert plan.certificate.ok, str(plan.certificate)
    assert plan.certificate.opening[0].clearance < -1.0


def test_arms_come_apart_past_a_kink():
    """Their clearance falls on one side of where they stand as fast as it grows by its slope on the other."""
    plane = few(np.array([[0.0, 0.0], [11.2, 22.4 * np.sqrt(0.75)]]))
    start = np.array([[1.1022, 0.6586], [2.8997, 2.0028]])
    plan = fp.separate(plane, fp.State(start), 0.8)
    assert len(plan.having(Outcome.DEADLOCKED)) == 0
    proof = fp.verify(plane, plan.trajectory, 0.8, opening=True)
    assert proof.ok
    assert np.isfinite(proof.opening[0].time)


@pytest.mark.parametrize("seed", [25, 31])
def test_the_margin_that_a_pair_reaches_within_a_step_is_kept(seed):
    """Here a pair gains, loses and gains within one step, and has the margin for a moment in between."""
    plane = fp.FocalPlane.hexagonal(2, 22.4, max_speed=np.radians(12.0))
    start = plane.kinematics.random(plane, np.random.default_rng(seed), np.arange(plane.n))
    plan = separate(plane, fp.State(start), 0.8)
    assert plan.certificate.ok, plan.certificate
    assert plan.problem.opening


def test_groups_come_apart_at_the_same_time_unless_their_arms_may_meet():
    plane = fp.FocalPlane.hexagonal(4, 22.4, max_speed=np.radians(12.0))
    start = plane.kinematics.random(plane, np.random.default_rng(1), np.arange(plane.n))
    said = []
    plan = separate(plane, fp.State(start), 0.8, said.append)
    assert plan.certificate.ok, plan.certificate
    groups = len(said)
    assert groups > 3
    assert said == [f"coming apart, group {k + 1} of {groups}" for k in range(groups)]
    ways = [plan[id_] for id_ in plane.ids if len(plan[id_].times) > 1]
    begins = [way.times[np.argmax((way.angles != way.angles[0]).any(axis=1)) - 1] for way in ways]
    assert np.sum(np.array(begins) == 0.0) > 3  # more than one group
    assert max(begins) > 0.0  # one that waits
