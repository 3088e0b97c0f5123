"""Certificates made false: of plan files with anything in them changed, none may pass its replay that is not true.

A mutation changes intervals, axes, pairs, coverage, geometry, motion, outcomes or what is said of the start, and the
digest is made right again. What the replay accepts is read as a plan, and `fiberplan.verify`, which knows nothing of
certificates, and dense sampling by shapely decide whether it is true all the same.
"""

import functools
import io
import json

import numpy as np
from astropy.io import fits

import fiberplan as fp
from fiberplan.certificates.replay import BadFileError, Claims
from fiberplan.certificates.replay_outcomes import faults
from fiberplan.certificates.whole_replay import _changed, replay
from fiberplan.errors import FiberplanError, PlanError, ProblemError
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.io.plan_file import plan_bytes
from fiberplan.io.sealed_tables import PLAN, seal
from fiberplan.plan import Plan
from fiberplan.scenes.uniform import uniform_field
from problems import four_bars, hexagon, several_heights
from references import smallest_over_time

SEEN = 1e-6  # [mm] what sampling sees below the margin is a contact


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


BASES = {
    "seven": many(1, 0.5, 1),
    "nineteen": many(2, 0.0, 2),
    "thirty-seven": many(3, 0.8, 3),
    "heights": several_heights,
    "concave": concave,
    "opening": opening,
    "four-bar": four_bars,
}


@functools.cache
def base(name):
    """(tables with their formats and units, claims) of a plan whose every claim holds."""
    planner = "prioritized-roadmap" if name == "four-bar" else "direct"
    content = plan_bytes(fp.planners.PLANNERS[planner]().plan(BASES[name]()))
    with fits.open(io.BytesIO(content), character_as_bytes=True) as hdul:
        columns = {hdu.name: [(column.name, column.format, column.unit) for column in hdu.columns] for hdu in hdul[1:]}
    claims = Claims(content)
    assert replay(claims, jobs=1).faults == (), name
    return columns, claims


def sealed(columns, tables, version=PLAN.version):
    """The file that these tables make, its digest right."""
    made = []
    for name, of in columns.items():
        data = {key: tables[name][key] == b"T" if form == "L" else tables[name][key] for key, form, _ in of}
        formed = [fits.Column(key, form, unit, array=data[key]) for key, form, unit in of]
        made.append(fits.BinTableHDU.from_columns(formed, name=name))
    return seal(PLAN._replace(version=version), made)


def number(rng, value):
    """Another number: near, elsewhere, or none."""
    kind = rng.integers(8)
    if kind < 4:
        return value + rng.normal() * 10.0 ** rng.uniform(-7, 0)
    return (value * rng.uniform(-1, 2), rng.uniform(-7, 7), 0.0, rng.choice([np.nan, np.inf, -np.inf]))[kind - 4]


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
        said = json.loads(tables["PARAMETERS"]["json"][0])
        margin = float(number(rng, said["problem"]["margin"]))
        for part in ("problem", "certificate")[: int(rng.integers(1, 3))]:
            said[part]["margin"] = margin
        text = json.dumps(said).encode()
        tables["PARAMETERS"] = np.array([(text,)], [("json", f"S{len(text)}")])
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


def accepted(tables, before):
    """Whether the replay of these tables, of which much is as `before`, finds nothing."""
    claims = object.__new__(Claims)
    try:
        claims._take(tables)
        pairs = list(claims.pairs())
        todo = set(_changed(claims, before, pairs))
        rows = {pair for pair in {*claims.rows, *before.rows} if claims.rows.get(pair) != before.rows.get(pair)}
        todo |= rows & set(pairs)
        return not any(faults(claims)) and all(claims.judge(*pair) is None for pair in sorted(todo))
    except (BadFileError, LookupError, TypeError, AttributeError, OSError, ValueError, RecursionError):
        return False  # as `Claims` refuses it


def is_true(content, folder):
    """Whether the plan in a file is safe and does as it says, by `verify` and sampling; None if it cannot be read."""
    path = folder / "mutated.fits"
    path.write_bytes(content)
    try:
        plan = Plan.read(path)
        found = plan.faults()
    except (PlanError, FiberplanError):
        return None
    if not found:
        return True
    problem, plane = plan.problem, plan.problem.plane
    proof = plan.certificate
    if found != [str(proof)] or proof.zones or any("changes its speed" not in v for v in proof.violations):
        return False
    for contact in (*proof.contacts, *proof.undecided):
        i, arm = contact.pair[0], plane.arm(contact.pair[1])
        error = problem.position_error[[k for k in (i, arm) if k < plane.n]].sum()
        if smallest_over_time(plane, plan.trajectory, i, arm, 500)[0] - error < problem.margin - SEEN:
            return False
    return True


def mutations(rng: np.random.Generator, folder) -> None:
    """Fifty mutations of a plan: none is accepted unless what it claims is true."""
    name = rng.choice(list(BASES))
    for _ in range(50):
        outcome, kind, _ = one_mutation(rng, name, folder)
        assert outcome != "false", f"{name}: a false certificate is accepted after a mutation of {kind}"


def one_mutation(rng, name, folder):
    """("refused", "true", "false" or "unreadable", what was changed, the tables) of one mutation of a base."""
    columns, before = base(name)
    tables = {key: table.copy() for key, table in before.tables.items()}
    kinds = [mutate(rng, tables) for _ in range(int(rng.choice([1, 1, 1, 2, 3])))]
    with np.errstate(all="ignore"):
        if not accepted(tables, before):
            return "refused", kinds, tables
    others = (key for key in tables if key != "CERTIFICATE_AXES")
    if all(tables[key].tobytes() == before.tables[key].tobytes() for key in others):
        return "true", kinds, tables  # the same motion among the same arms
    formats = {key: list(of) for key, of in columns.items()}
    width = tables["PARAMETERS"].dtype["json"].itemsize
    formats["PARAMETERS"] = [("json", f"{width}A", None)]
    true = is_true(sealed(formats, tables), folder)
    return {True: "true", False: "false", None: "unreadable"}[true], kinds, tables
