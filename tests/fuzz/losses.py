"""Proofs that goals are out of reach made false: of changed plan files, none may pass its replay that is not true.

A mutation changes marks, cuts and parts of the boxes; of whom they are, who turns, who is lost, where the goals are;
margin, position errors, start, goals, ranges, speeds, arms, obstacles, who can move, outcomes, and the time there is.
What is accepted counts as false if a motion brings who is lost to what was asked of it, with those at their goals who
the proof says arrive: sought by boxes and by random trees, certified by `fiberplan.verify`. Or if a random walk that
keeps the margin, by shapely, leaves the boxes that it is said to stay in.
"""

import itertools

import numpy as np

import fiberplan as fp
from fiberplan.certificates.replay_infeasible import has_proof
from fiberplan.certificates.replay_outcomes import not_replayed
from fiberplan.certificates.unreachable import decided
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.io.certificate_tables import proofs_as_tables
from fiberplan.io.plan_file import plan_bytes
from fiberplan.io.plan_tables import plan_hdus
from fiberplan.io.sealed_tables import PLAN, seal
from fiberplan.plan import Outcome
from fiberplan.planners.shared.rrt_connect import joint_path
from fiberplan.tolerances import NEAR
from fuzz.barriers import walk_stays
from fuzz.loss_mutations import mutate, trees
from fuzz.made_false import Kind, none_is_accepted
from references import make_plane

ARM = np.array([[0.0, 0.0], [15.0, 0.0]])  # [mm]; the arm is stiff, 22.4 mm from base to tip
BOXES, NODES = 60_000, 500  #: of a search for a motion
BELOW = 1e-6 - 1e-9  # [mm] a motion this much nearer than the margin contradicts a proof


def stiff(base, zero, lower, upper, obstacles=(), online=True, **others):
    """Arms that turn about their bases only, between `lower` and `upper` (n,) [deg] from `zero` (n,) [deg]."""
    body = fp.Body(ARM, 1.5)
    n = len(base)
    none = np.zeros(n)
    return make_plane(
        base,
        [body],
        [Obstacle(f"post {k}", [at], 1.5, meets=None) for k, at in enumerate(obstacles)],
        length=7.4,
        zero=np.radians(np.stack([np.broadcast_to(zero, n), none], axis=1)),
        lower=np.radians(np.stack([np.broadcast_to(lower, n), none], axis=1)),
        upper=np.radians(np.stack([np.broadcast_to(upper, n), none + 0.01], axis=1)),
        online=np.broadcast_to(online, n),
        **others,
    )


def turned(*alphas):
    """A configuration of stiff arms (n, 2) [rad], of their alphas [deg]."""
    return np.radians([[alpha, 0.0 * alpha] for alpha in alphas])


def pocket(gap=0.2, **others):
    """One arm, and a post past which `gap` [mm] less is left than its margin asks for; two places behind it count."""
    plane = stiff([[0.0, 0.0]], 0.0, -286.0, 97.0, [[0.0, 15.0], [0.0, -25.4 - gap]])
    return fp.Problem(plane, turned(45.0), turned(-225.0), 0.3, alternatives=turned(-200.0)[None], **others)


def late():
    """One arm with nothing in its way, too far from its goal for the time there is."""
    plane = stiff([[0.0, 0.0]], 0.0, -286.0, 97.0, [[0.0, 15.0]], max_speed=0.5)
    return fp.Problem(plane, turned(45.0), turned(-225.0), 0.3)


def hemmed():
    """One arm between two that cannot move, which reach to it."""
    base = [[0.0, 0.0], [48.0, 0.0], [-48.0, 0.0]]
    plane = stiff(base, 0.0, 0.0, 360.0, online=[True, False, False])
    return fp.Problem(plane, turned(45.0, 180.0, 0.0), turned(300.0, np.nan, np.nan), 0.3)


def facing(first=53.5, second=90.0):
    """Two arms that point at each other and can turn so far [deg]: they would have to pass through each other."""
    plane = stiff([[0.0, 0.0], [32.0, 0.0]], [0.0, 180.0], [-first, -second], [first, second], [[-6.0, 9.0]])
    return fp.Problem(plane, turned(30.0, 0.0), turned(-30.0, 0.0), 0.5, priority=[1.0, 2.0])


def narrow():
    """As `facing`, and the second does not turn far enough to let the first pass, wherever it would end."""
    problem = facing(31.0, 53.0)
    return fp.Problem(problem.plane, problem.start, turned(-30.0, np.nan), 0.5)


def excluded():
    """One arm whose goal leaves the other, which turns by 20.5 deg, no place."""
    plane = stiff([[0.0, 0.0], [32.0, 0.0]], [0.0, 180.0], [-90.0, -20.5], [90.0, 20.5], [[-6.0, 9.0]])
    return fp.Problem(plane, turned(45.0, 0.0), turned(0.0, np.nan), 0.5)


def three():
    """The first can pass the second only where that would be in the third's way, which cannot give way."""
    base = [[0.0, 0.0], [32.0, 0.0], [28.2, -30.0]]
    plane = stiff(base, [0.0, 180.0, 90.0], [-31.0, -20.0, -5.0], [31.0, 90.0, 5.0])
    return fp.Problem(plane, turned(30.0, 0.0, 0.0), turned(-30.0, np.nan, np.nan), 0.5)


def lost(problem, turns=(), **parameters):
    """The content of the file of a plan in which nobody moves, and the first is lost, proven, for the others.

    Where `turns` are given, the proof is of these: what writes plan files asks of two at most.
    """

    def made():
        asked = problem()
        others = tuple(range(1, asked.n))
        words = [Outcome.ARRIVED if has else Outcome.NO_TARGET for has in asked.has_goal[1:]]
        outcomes = [Outcome.INFEASIBLE, *np.where(asked.plane.online[1:], words, Outcome.OFFLINE)]
        blockers = {} if turns else {0: others}
        still = fp.Trajectory.at_rest(asked.start)
        plan = fp.Plan(asked, still, tuple(outcomes), "direct", parameters, blockers=blockers)
        if not turns:
            return plan_bytes(plan)
        goal = {0: asked.goal[0]}
        assert all(
            decided(asked.plane, who, goal, asked.start, asked.margin)[1] is None for who in ([0], [0, 1], [1, 2])
        )
        barrier = decided(asked.plane, turns, goal, asked.start, asked.margin)[1]
        return seal(PLAN, [*plan_hdus(plan), *proofs_as_tables([(0, barrier)])])

    return made


BASES = {
    "pocket": lost(pocket),
    "late": lost(late, max_time=1.0),
    "hemmed": lost(hemmed),
    "facing": lost(facing),
    "narrow": lost(narrow),
    "excluded": lost(excluded),
    "three": lost(three, (0, 1, 2)),
}


def is_true(plan, claims) -> bool:
    """Whether nobody who is said to be lost, proven, is found able to reach what was asked of it."""
    rng, lost = np.random.default_rng(0), plan.having(Outcome.INFEASIBLE).tolist()
    proven = [i for i in lost if has_proof(claims, i)]
    told = proven == lost or any("without a claimed proof" in note for note in not_replayed(claims))
    return told and not any(_can_arrive(plan, claims, i) or _leaves(rng, plan, claims, i) for i in proven)


def _barriers(claims, i):
    """Rows of each proof that i is lost."""
    rows = claims.tables.get("CERTIFICATE_BARRIERS")
    numbers = [] if rows is None else np.unique(rows["barrier"][rows["lost"] == i]).tolist()
    return {k: rows[rows["barrier"] == k] for k in numbers}


def _can_arrive(plan, claims, i):
    """Whether a motion of those that its proofs name brings i to a goal in time, and others to theirs, who arrive."""
    problem, barriers = plan.problem, _barriers(claims, i).values()
    named = sorted({i, *(int(j) for rows in barriers for j in rows["positioner"])})
    others = sorted({int(r["positioner"]) for rows in barriers for r in rows if not np.isnan(r["goal_alpha"])} - {i})
    speed, most = problem.plane.max_speed[i], plan.parameters.get("max_time")
    in_time = [
        end for end in _ends(problem, i) if most is None or (np.abs(end - problem.start[i]) / speed).max() <= most
    ]
    for end, *places in itertools.product(in_time, *(_ends(problem, j) for j in others)):
        if _path(problem, named, dict(zip([i, *others], [end, *places], strict=True))):
            return True
    return False


def _ends(problem, i):
    """What was asked of i, and what else counts as that (k, 2)."""
    others = np.empty((0, 2)) if problem.alternatives is None else problem.alternatives[i]
    every = np.concatenate([problem.requested[i][None], others])
    return every[~np.isnan(every).any(axis=1)]


def _path(problem, who, goals) -> bool:
    """Whether there is a motion of `who` to `goals`, past what never moves, that `verify` certifies."""
    plane, start, margin = problem.plane, problem.start, problem.margin
    if not (np.isfinite([plane.lower[who], plane.upper[who]]).all() and len(who) <= 3):
        return False
    found, _ = decided(plane, who, goals, start, margin, BOXES)
    if found is None:
        end = np.array([goals.get(j, problem.start[j]) for j in who])
        near = Neighbourhood.of(plane, margin + NEAR)
        way, _ = joint_path(plane, near, np.array(who), start, end, margin, 0, NODES)
        found = None if way is None else way[1]
    if found is None:
        return False
    path = found.reshape(len(found), -1, 2)
    there = np.array(sorted({*who, *np.flatnonzero(~plane.online).tolist()}))
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path, axis=0)).max(axis=(1, 2)) + 1e-3)])
    angles = np.repeat(start[None], len(path), axis=0)
    angles[:, who] = path
    few = plane.subset(there).replace(max_speed=np.full((len(there), 2), 2.0))
    proof = fp.verify(few, fp.Trajectory.from_samples(times, angles[:, there]), max(margin - BELOW, 0.0))
    return proof.ok and all((angles[-1, j] == at).all() for j, at in goals.items())


def _leaves(rng, plan, claims, i) -> bool:
    """Whether a random walk leaves the boxes of a proof that i is lost."""
    problem = plan.problem
    for k, rows in _barriers(claims, i).items():
        who = rows["positioner"][rows["turns"] == b"T"].tolist()
        if not walk_stays(rng, problem.plane, problem.start, problem.margin, who, trees(claims.tables)[k]):
            return True
    return False


LOSSES = Kind(BASES, mutate, is_true)


def losses(rng: np.random.Generator, folder) -> None:
    """Fifty mutations of a plan in which a goal is proven out of reach: none is accepted unless that is true."""
    none_is_accepted(rng, LOSSES, folder)
