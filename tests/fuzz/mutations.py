"""Certificates of safety made false: of changed plan files, none may pass its replay that is not true.

A mutation changes intervals, axes, pairs, coverage, geometry, motion, outcomes or what is said of the start.
"""

import numpy as np

import fiberplan as fp
from fiberplan.errors import ProblemError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.io.plan_file import plan_bytes
from fiberplan.scenes.uniform import uniform_field
from fuzz.made_false import Kind, none_is_accepted, number, restate, set_margin
from problems import four_bars, hexagon, several_heights


def opening():
    """Seven robots of which two begin nearer than the margin."""
    plane = hexagon(1, max_speed=np.radians(12.0))
    start = plane.folded.copy()
    middle, right = (int(np.argmin(np.hypot(*(plane.base - at).T))) for at in ([0.0, 0.0], [22.4, 0.0]))
    start[middle], start[right] = np.radians([0.0, 29.9]), np.radians([180.0, 29.9])
    return fp.Problem(plane, start, uniform_field(plane, 5, 0.8), 0.8, near_start="open", conflicts="drop")


def concave():
    """Seven DESI robots, whose outlines are not convex, with a wall."""
    plane = fp.FocalPlane.load("desi")
    plane = plane.subset(np.argsort(np.hypot(*(plane.base - plane.base.mean(axis=0)).T))[:7])
    x, y = plane.base.min(axis=0) - 9.0
    corner = [[x, y], [x + 30.0, y], [x + 30.0, y + 1.0], [x + 1.0, y + 1.0], [x + 1.0, y + 30.0], [x, y + 30.0]]
    plane = plane.replace(obstacles=(Obstacle("corner", corner, closed=True, category="phi"),))
    return fp.Problem(plane, plane.folded, uniform_field(plane, 3, 0.05), 0.05, conflicts="drop")


def many(rings, margin, seed):
    """A hexagon with posts, of which some robots cannot move."""

    def problem():
        rng = np.random.default_rng(seed)
        posts = tuple(Obstacle(f"post {k}", rng.uniform(-40, 40, (1, 2)), 1.0) for k in range(3))
        plane = hexagon(rings)
        start = uniform_field(plane, seed, margin)
        plane = plane.replace(online=rng.random(plane.n) > 0.1)
        for obstacles in (posts, posts[:1], ()):
            try:
                goal = uniform_field(plane, seed + 50, margin)
                problem = fp.Problem(plane.replace(obstacles=obstacles), start, goal, margin, conflicts="drop")
            except ProblemError:  # the start touches a post
                continue
            return problem

    return problem


def planned(problem, planner="direct"):
    """The content of the file of a problem's plan."""
    return lambda: plan_bytes(fp.planners.PLANNERS[planner]().plan(problem()))


BASES = {
    "seven": planned(many(1, 0.5, 1)),
    "nineteen": planned(many(2, 0.0, 2)),
    "thirty-seven": planned(many(3, 0.8, 3)),
    "heights": planned(several_heights),
    "concave": planned(concave),
    "opening": planned(opening),
    "four-bar": planned(four_bars, "prioritized-roadmap"),
}


def mutate(rng, tables):
    """Change something in one table; returns what, in words."""
    kind = rng.choice(["axes", "intervals", "pairs", "coverage", "geometry", "motion", "outcomes", "start", "said"])
    axes, n = tables["CERTIFICATE_AXES"], len(tables["POSITIONERS"])
    if not len(axes):
        return "coverage"
    k = int(rng.integers(len(axes)))
    if kind == "axes":
        axes["axis"][k] = number(rng, axes["axis"][k])
    elif kind == "intervals":
        end = rng.choice(["begin", "end"])
        axes[end][k] = number(rng, axes[end][k])
        if rng.random() < 0.2:
            axes["begin"][k], axes["end"][k] = axes["end"][k], axes["begin"][k]
    elif kind == "pairs":
        end = rng.choice(["first", "second"])
        axes[end][k] = rng.integers(-3, n + 2)
    elif kind == "coverage":
        cut = rng.integers(4)
        if cut == 0:
            tables["CERTIFICATE_AXES"] = np.delete(axes, k)
        elif cut == 1:
            same = (axes["first"] == axes["first"][k]) & (axes["second"] == axes["second"][k])
            tables["CERTIFICATE_AXES"] = axes[~same]
        elif cut == 2:
            tables["CERTIFICATE_AXES"] = rng.permutation(np.append(axes, axes[k : k + 3]))
        else:
            tables["CERTIFICATE_AXES"] = axes[: int(rng.integers(len(axes)))]
    elif kind == "geometry":
        _geometry(rng, tables)
    elif kind == "motion":
        knots = tables["KNOTS"]
        k, name = int(rng.integers(len(knots))), rng.choice(["time", "alpha", "beta"])
        knots[name][k] = number(rng, knots[name][k])
        if rng.random() < 0.1:
            tables["KNOTS"] = np.delete(knots, k)
    elif kind == "outcomes":
        i, name = int(rng.integers(n)), rng.choice(["OFFLINE", "NO_TARGET", "DROPPED", "ARRIVED", "DEADLOCKED"])
        for table in ("POSITIONERS", "PROBLEM"):
            tables[table]["outcome"][i] = name.encode()
    elif kind == "start":
        problem = tables["PROBLEM"]
        i, name = int(rng.integers(n)), rng.choice(["start", "goal", "requested", "goal and requested"])
        for part in name.split(" and "):
            column = f"{part}_{rng.choice(['alpha', 'beta'])}"
            problem[column][i] = number(rng, problem[column][i])
    else:
        _said(rng, tables)
    return str(kind)


def _geometry(rng, tables):
    """Another place, length, range, speed, shape, height or who can move."""
    name = rng.choice(["BODIES", "POSITIONERS", "OBSTACLES"])
    table = tables[name] if len(tables[name]) else tables["BODIES"]
    if name == "POSITIONERS" or table is not tables[name]:
        numbers = [key for key in table.dtype.names if table.dtype[key].kind == "f"]
    else:
        numbers = ["x", "y", "radius"]
    k, turn = int(rng.integers(len(table))), rng.random()
    if turn < 0.6:
        key = rng.choice(numbers)
        table[key][k if key != "radius" else slice(None)] = number(rng, float(table[key][k]))
    elif name == "POSITIONERS":
        table["online"][k] = b"F" if table["online"][k] == b"T" else b"T"
    elif turn < 0.8:
        table["closed"] = b"F" if table["closed"][k] == b"T" else b"T"
    else:
        of = table["body" if "body" in table.dtype.names else "obstacle"]
        table["meets"][of == of[k]] = rng.choice([b"[]", b"null"])


def _said(rng, tables):
    """Another margin, position error, or pair that is said to begin nearer."""
    which = rng.integers(3)
    if which == 0:
        both = rng.random() < 0.5
        restate(tables, lambda said: set_margin(said, float(number(rng, said["problem"]["margin"])), both))
    elif which == 1:
        error = tables["PROBLEM"]["position_error"]
        error[int(rng.integers(len(error)))] = number(rng, 0.0)
    else:
        proof = tables["CERTIFICATE"]
        rows = np.flatnonzero(proof["kind"] == b"opening")
        if len(rows) and rng.random() < 0.7:
            name = rng.choice(["time", "clearance"])
            proof[name][rows[0]] = number(rng, proof[name][rows[0]])
        else:
            k = int(rng.integers(len(proof)))
            proof["kind"][k], proof["time"][k] = b"opening", rng.choice([np.inf, np.nan, rng.uniform(-1, 30)])
            proof["clearance"][k] = rng.choice([-2.0, rng.uniform(-1, 1), proof["clearance"][k]])


SAFETY = Kind(BASES, mutate, lambda plan, claims: True)


def mutations(rng: np.random.Generator, folder) -> None:
    """Fifty mutations of a plan: none is accepted unless what it claims is true."""
    none_is_accepted(rng, SAFETY, folder)
