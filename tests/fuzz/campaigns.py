"""Each campaign is a function of a random generator and a folder; it fails by any exception but an expected refusal."""

from pathlib import Path

import numpy as np
import shapely

import fiberplan as fp
from fiberplan.errors import FiberplanError, InstrumentError, PlanError, ProblemError
from fiberplan.focal_plane.bodies import Obstacle, convex_pieces
from fiberplan.io.plan_file import plan_bytes
from fiberplan.motion import Trajectory
from fiberplan.plan import Outcome, Plan
from fiberplan.planners import PLANNERS, amend
from fiberplan.scenes.uniform import uniform_field
from fuzz.audits import audits
from fuzz.barriers import barriers
from fuzz.losses import losses
from fuzz.mutations import mutations
from fuzz.planted import planted, spared
from problems import hexagon
from references import (
    clearance_over_time,
    first_below,
    four_bar_plane,
    looks,
    path_past_fixed,
    sampled_clearance,
    smallest_over_time,
    varied_plane,
)

SHORT = {"grid": (4, 3), "dt": 1.0, "collision_dt": 0.25, "max_time": 25.0, "orders": 1, "early_abort": True}
FIELD = {"D": 6.0, "d": 3.0, "dt": 0.04}
VARIANTS = (
    ("direct", {}),
    ("direct", {"max_time": 9.0}),
    *(("greedy-fold", {"relief": r, "step": 0.02}) for r in ("joint", "reverse", "replace", "none")),
    *(("elliptic-navigation-function", {"relief": r}) for r in ("layers", "none")),
    ("prioritized-roadmap", SHORT),
    *(("navigation-function", {"mode": m, **FIELD}) for m in ("repaired", "literal")),
)
SEEN = 1e-4  # [mm] sampling is this coarse


def is_one_line(refused: FiberplanError) -> None:
    """A refusal is to be read at a glance."""
    assert "\n" not in str(refused)


def proofs(rng: np.random.Generator, folder: Path) -> None:
    """Motions of arms of all kinds, half of them with a contact planted: what `verify` says is what sampling sees."""
    bars = rng.random() < 0.3
    plane = four_bar_plane(rng) if bars else varied_plane(rng)
    plane = plane.replace(max_speed=np.full((plane.n, 2), 1e3))
    motion = _random_motion(rng, plane, meet=not bars)
    margin, jitter = rng.choice([0.0, 0.5]), rng.choice([0.0, 0.0, 0.03])
    proof = fp.verify(plane, motion, margin, jitter)
    told = {c.pair for c in (*proof.contacts, *proof.undecided)}
    claimed = {c.pair: c for c in proof.contacts}
    if proof.zones:
        return  # past a zone of avoidance nothing else is claimed
    for i in range(plane.n):
        for arm in range(i + 1, plane.n + len(plane.obstacles)):
            pair = (i, arm if arm < plane.n else plane.n - 1 - arm)
            if jitter:
                _clocks_are_allowed_for(rng, plane, motion, (i, arm), margin, jitter, pair in told)
                continue
            seen, _ = smallest_over_time(plane, motion, i, arm, 300)
            assert seen >= margin - SEEN or pair in told, f"{pair} comes within {seen:.4f} mm at margin {margin}"
            if pair in claimed:
                when = first_below(plane, motion, i, arm, margin + SEEN, 300, claimed[pair].time)
                assert when is not None, f"{pair} is said to touch and is {seen:.4f} mm apart"


def _clocks_are_allowed_for(rng, plane, motion, arms, margin, jitter, told):
    """Clocks that are off by no more than the jitter bring nobody closer than a safe motion says."""
    for shifts in rng.uniform(-jitter, jitter, (6, 2)):
        times = looks(motion, *arms, 300)
        seen = clearance_over_time(plane, motion, *arms, times, *shifts).min()
        assert seen >= margin - SEEN or told, f"{arms} come within {seen:.4f} mm with clocks off by {shifts}"


def _random_motion(rng, plane, meet):
    """A walk of a few knots each, of small turns unless in half of them a pair is to meet at some time."""
    size = 1.5 if meet else 0.3
    count = int(rng.integers(2, 6))
    times = np.cumsum(rng.uniform(0.2, 2.0, (plane.n, count)), axis=1)
    angles = plane.folded[:, None] + np.cumsum(rng.normal(0.0, size, (plane.n, count, 2)), axis=1)
    if meet and rng.random() < 0.5:
        i, j = rng.choice(plane.n, 2, replace=False)
        tried = rng.uniform(-np.pi, np.pi, (2, 200, 2))
        gaps = sampled_clearance(plane, i, j, *tried)
        k = int(np.argmin(np.where(gaps < 0.0, rng.random(200), np.inf)))
        at = int(rng.integers(count))
        angles[i, at], angles[j, at], times[j] = tried[0, k], tried[1, k], times[i]
    return Trajectory(np.arange(plane.n + 1) * count, times.ravel(), angles.reshape(-1, 2))


def outlines(rng: np.random.Generator, folder: Path) -> None:
    """A random outline is refused in one line, or cut into convex pieces that cover just it."""
    count = int(rng.integers(3, 12))
    if rng.random() < 0.5:
        corners = rng.normal(0.0, 5.0, (count, 2))
    else:
        turn = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
        corners = rng.uniform(0.5, 9.0, (count, 1)) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    if rng.random() < 0.3:
        corners = np.round(corners)  # corners on edges, and in a line
    shape = shapely.Polygon(corners)
    try:
        pieces = convex_pieces(corners, closed=True)
    except InstrumentError as refused:
        is_one_line(refused)
        assert not shape.is_valid or shape.area < 1e-9, f"refused a simple outline: {corners.tolist()}"
        return
    parts = [shapely.Polygon(piece) for piece in pieces if len(piece) > 2]
    assert np.isclose(sum(part.area for part in parts), shape.area, rtol=1e-9, atol=1e-9), "pieces overlap"
    assert shapely.symmetric_difference(shapely.union_all(parts), shape).area < 1e-6
    for part in parts:
        assert np.isclose(part.convex_hull.area, part.area, rtol=1e-9, atol=1e-9), "a piece is not convex"


def small_problem(rng: np.random.Generator) -> fp.Problem:
    """Seven to nineteen arms with everything that makes problems differ; goals are dropped where they touch."""
    plane, margin = hexagon(int(rng.integers(1, 3))), float(rng.choice([0.0, 0.5, 1.5]))
    n = plane.n
    if rng.random() < 0.5:
        plane = plane.replace(max_speed=np.radians(rng.uniform(8.0, 40.0, (n, 2))))
    if rng.random() < 0.3:
        plane = plane.replace(length=plane.length + rng.uniform(-0.3, 0.3, n), zero=rng.normal(0.0, 0.1, (n, 2)))
    start = np.array(plane.folded if rng.random() < 0.5 else uniform_field(plane, int(rng.integers(1000)), margin))
    if rng.random() < 0.4:
        plane = plane.replace(online=rng.random(n) > 0.15)
    if rng.random() < 0.4:
        posts = (Obstacle(f"post {k}", rng.uniform(-40, 40, (1, 2)), 1.0) for k in range(3))
        plane = plane.replace(obstacles=tuple(posts))
    goal = plane.kinematics.random(plane, rng, np.arange(n))
    goal[rng.random(n) < rng.choice([0.0, 0.2])] = np.nan
    return fp.Problem(plane, start, goal, margin, rng.integers(1, 4, n).astype(float), "drop")


def _possible(rng):
    while True:
        try:
            return small_problem(rng)
        except ProblemError:  # the start touches a post
            continue


def assert_true(plan: Plan) -> None:
    """The motion is proven, arrivals are there, and nobody is called unable who could."""
    problem, limit = plan.problem, plan.parameters.get("max_time")
    assert plan.faults() == []
    for i in plan.having(Outcome.INFEASIBLE):
        needed = (np.abs(problem.goal[i] - problem.start[i]) / problem.plane.max_speed[i]).max()
        slow = limit is not None and needed > limit
        path = path_past_fixed(problem.plane, i, problem.start, problem.goal[i], problem.margin, 0.04)
        assert slow or path is not True, f"{problem.plane.ids[i]} is called unable to reach its goal"
    assert set(plan.blockers) <= set(plan.lost.tolist())


def plans(rng: np.random.Generator, folder: Path) -> None:
    """Every planner on random small problems, or one line that says why not."""
    problem = _possible(rng)
    name, settings = VARIANTS[rng.integers(len(VARIANTS))]
    try:
        plan = PLANNERS[name](**settings).plan(problem)
    except FiberplanError as refused:
        is_one_line(refused)
        return
    assert_true(plan)


def files(rng: np.random.Generator, folder: Path) -> None:
    """Of a plan file with some bits flipped, cut short or with bytes put in: one line, or the same plan."""
    problem = _possible(rng)
    plan = fp.planners.GreedyFold(step=0.05, relief="none").plan(problem)
    content = bytearray(plan_bytes(plan))
    kind = rng.integers(3)
    if kind == 0:
        for at in rng.integers(0, len(content), int(rng.integers(1, 4))):
            content[at] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del content[int(rng.integers(len(content))) :]
    else:
        at = int(rng.integers(len(content)))
        content[at:at] = rng.bytes(int(rng.integers(1, 3000)))
    path = folder / "damaged.fits"
    path.write_bytes(content)
    try:
        again = Plan.read(path)
    except PlanError as refused:
        is_one_line(refused)
        return
    assert plan_bytes(again) == plan_bytes(plan)


def amendments(rng: np.random.Generator, folder: Path) -> None:
    """One goal after another changes: the motion stays proven, and nobody else's outcome gets worse."""
    plan = fp.planners.GreedyFold(step=0.05).plan(_possible(rng))
    plane = plan.problem.plane
    for _ in range(3):
        i = int(rng.choice(np.flatnonzero(plane.online))) if plane.online.any() else 0
        goal = plane.kinematics.random(plane, rng, np.array([i]))[0]
        try:
            new = amend(plan, i, goal)
        except FiberplanError as refused:
            is_one_line(refused)
            continue
        assert_true(new)
        before, after = ({*p.having(Outcome.ARRIVED).tolist()} - {i} for p in (plan, new))
        assert before <= after
        plan = new


def interrupts(rng: np.random.Generator, folder: Path) -> None:
    """A deadline or Ctrl-C at any moment that can be told apart leaves a plan that holds."""
    problem, calls = _possible(rng), [int(rng.integers(6))]

    def report(text):
        calls[0] -= 1
        if calls[0] < 0:
            raise KeyboardInterrupt

    how = {"deadline": float(rng.choice([0.0, 0.01, 0.1]))} if rng.random() < 0.5 else {"report": report}
    assert_true(fp.planners.Direct().plan(problem, **how))


CAMPAIGNS = {
    f.__name__: f
    for f in (
        proofs,
        planted,
        spared,
        mutations,
        losses,
        barriers,
        outlines,
        plans,
        files,
        amendments,
        interrupts,
        audits,
    )
}
