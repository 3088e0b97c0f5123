"""Plain references that share no code with the kernels: textbook formulas in numpy, and shapely as a witness."""

import itertools

import numpy as np
import shapely
from scipy.ndimage import label

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.motion import Trajectory


def segment_distance(a, b, c, d):
    """Distance of segments ab and cd by clamping the closest points of their lines (Ericson, ch. 5.1.9)."""
    a, b, c, d = (np.asarray(p, float) for p in (a, b, c, d))
    u, v, r = b - a, d - c, a - c
    uu, vv, uv, ur, vr = u @ u, v @ v, u @ v, u @ r, v @ r
    best = np.inf
    starts = [0.0, 1.0]
    if uu * vv - uv * uv > 1e-14 * uu * vv:
        starts.append(np.clip((uv * vr - ur * vv) / (uu * vv - uv * uv), 0, 1))
    for s in starts:
        t = np.clip((uv * s + vr) / vv, 0, 1) if vv > 0 else 0.0
        s = np.clip((uv * t - ur) / uu, 0, 1) if uu > 0 else 0.0
        best = min(best, float(np.linalg.norm(a + s * u - c - t * v)))
    return best


def links(plane, i, angles):
    """Elbow (t, 2) and directions (t,), (t,) of both links of positioner i at `angles` (t, 2)."""
    first = angles[:, 0] + plane.zero[i, 0]
    second = first + angles[:, 1] + plane.zero[i, 1]
    elbow = plane.base[i] + plane.length[i] * np.stack([np.cos(first), np.sin(first)], axis=1)
    return elbow, first, second


def four_bar_joints(plane, i, angles):
    """J1 (scalar), J2, J3, J4 (t,) of a four-bar arm at `angles` (t, 2), as complex numbers in the focal plane."""
    bar, (t1, t2) = plane.kinematics, (angles + plane.zero[i]).T
    x = np.exp(1j * bar.orientation[i])
    j1 = complex(*plane.base[i])
    j2 = j1 + bar.spacing[i] * x
    return j1, j2, j1 + plane.length[i] * np.exp(1j * t1) * x, j2 - bar.rocker[i] * np.exp(-1j * t2) * x


def four_bar_placed(plane, i, body, angles):
    """Points (t, k, 2) of a four-bar arm's body at `angles` (t, 2)."""
    j1, j2, j3, j4 = four_bar_joints(plane, i, angles)
    points = (body.points[i] if body.points.ndim == 3 else body.points) @ np.array([1, 1j])
    one = np.ones(len(angles))
    origin = {"base": j1 * one, "alpha": j1 * one, "beta": j3, "rocker": j2 * one}[body.link]
    along = {"base": one, "alpha": j3 - j1, "beta": j4 - j3, "rocker": j4 - j2}[body.link]
    found = origin[:, None] + (along / np.abs(along))[:, None] * points
    return np.stack([found.real, found.imag], axis=2)


def placed(plane, i, body, angles):
    """Points (t, k, 2) of a positioner's body at `angles` (t, 2)."""
    if isinstance(plane.kinematics, FourBar):
        return four_bar_placed(plane, i, body, angles)
    points = body.points[i] if body.points.ndim == 3 else body.points
    elbow, first, second = links(plane, i, angles)
    origin = elbow if body.link == "beta" else np.broadcast_to(plane.base[i], elbow.shape)
    turn = {"base": np.zeros(len(angles)), "alpha": first, "beta": second}[body.link]
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x, y = points.T
    return origin[:, None] + np.stack([c * x - s * y, s * x + c * y], axis=2)


def geometry(points, closed):
    """Shapely shapes (t,) of `points` (t, k, 2)."""
    if points.shape[1] == 1:
        return shapely.points(points[:, 0])
    if closed and points.shape[1] > 2:
        return shapely.polygons(points)
    return shapely.linestrings(points)


def shapes(plane, arm, angles):
    """(shapely shapes (t,), radius, category, meets) of each body of an arm; arm n + k is obstacle k."""
    if arm >= plane.n:
        o = plane.obstacles[arm - plane.n]
        shape = geometry(np.broadcast_to(o.points, (len(angles), *o.points.shape)), o.closed)
        return [(shape, o.radius, o.category, o.meets)]
    found = []
    for body in plane.bodies:
        radius = float(np.broadcast_to(body.radius, plane.n)[arm])
        found.append((geometry(placed(plane, arm, body, angles), body.closed), radius, body.category, body.meets))
    return found


def sampled_clearance(plane, i, j, angles_i, angles_j):
    """Clearance (t,) of two arms at `angles_i` and `angles_j` (t, 2), by shapely [mm]."""
    smallest = np.full(len(angles_i), np.inf)
    pairs = itertools.product(shapes(plane, i, angles_i), shapes(plane, j, angles_j))
    for (a, r, category_a, meets_a), (b, s, category_b, meets_b) in pairs:
        if meets_a is None or meets_b is None or category_b in meets_a or category_a in meets_b:
            smallest = np.minimum(smallest, shapely.distance(a, b) - r - s)
    return smallest


def sampled(trajectory, arm, times):
    """Angles (t, 2) of an arm at `times`; zeros for obstacles."""
    if arm >= trajectory.n:
        return np.zeros((len(times), 2))
    own = slice(trajectory.offsets[arm], trajectory.offsets[arm + 1])
    return np.stack([np.interp(times, trajectory.times[own], q) for q in trajectory.angles[own].T], axis=1)


def clearance_over_time(plane, trajectory, i, j, times, shift_i=0.0, shift_j=0.0):
    """Clearance (t,) of two arms whose clocks are off by so much at `times`, by shapely [mm]."""
    angles_i, angles_j = sampled(trajectory, i, times + shift_i), sampled(trajectory, j, times + shift_j)
    return sampled_clearance(plane, i, j, angles_i, angles_j)


def looks(trajectory, i, j, count):
    """Times to look at a pair: `count` evenly, and 30 in every stretch between the knots of either."""
    knots = [trajectory.times[slice(*trajectory.offsets[k : k + 2])] for k in (i, j) if k < trajectory.n]
    knots = np.unique(np.concatenate([[0.0, trajectory.duration], *knots]))
    between = knots[:-1, None] + np.diff(knots)[:, None] * np.linspace(0, 1, 30)
    return np.unique(np.concatenate([np.linspace(0.0, trajectory.duration, count), knots, between.ravel()]))


def smallest_over_time(plane, trajectory, i, j, count=2000):
    """(smallest sampled clearance, its time) with finer looks around the dozen smallest dips of the first."""
    times = looks(trajectory, i, j, count)
    for _ in range(4):
        values = clearance_over_time(plane, trajectory, i, j, times)
        smallest, when = float(values.min()), float(times[values.argmin()])
        walled = np.pad(values, 1, constant_values=np.inf)
        dips = np.flatnonzero((values <= walled[:-2]) & (values < walled[2:]))
        dips = dips[np.argsort(values[dips], kind="stable")][:12]
        low, high = times[np.maximum(dips - 1, 0)], times[np.minimum(dips + 1, len(times) - 1)]
        times = np.unique(low[:, None] + (high - low)[:, None] * np.linspace(0, 1, 21))
    return smallest, when


def first_below(plane, trajectory, i, j, margin, count=4000, when=0.0):
    """Earliest time looked at (`when` is one) at which the clearance is below the margin, refined; None if never."""
    times = np.unique(np.append(looks(trajectory, i, j, count), when))
    below = np.flatnonzero(clearance_over_time(plane, trajectory, i, j, times) < margin)
    if not len(below):
        return None
    if below[0] == 0:
        return 0.0
    low, high = times[below[0] - 1], times[below[0]]
    for _ in range(40):
        middle = 0.5 * (low + high)
        inside = clearance_over_time(plane, trajectory, i, j, np.array([middle]))[0] < margin
        low, high = (low, middle) if inside else (middle, high)
    return high


def make_plane(base, bodies, obstacles=(), length=5.0, max_speed=2.0, **others):
    """Positioners at `base` (n, 2) that may turn ten times either way."""
    base = np.asarray(base, float).reshape(-1, 2)
    n = len(base)
    fields = {
        "ids": tuple(f"P{i}" for i in range(n)),
        "base": base,
        "length": np.broadcast_to(np.asarray(length, float), n),
        "fiber_offsets": {"fiber": np.array([10.0, 0.0])},
        "folded": np.zeros((n, 2)),
        "lower": np.full((n, 2), -20 * np.pi),
        "upper": np.full((n, 2), 20 * np.pi),
        "max_speed": np.broadcast_to(np.asarray(max_speed, float), (n, 2)),
        "bodies": tuple(bodies),
        "obstacles": tuple(obstacles),
    }
    return FocalPlane(**(fields | others))


def four_bar_plane(rng, n=3, shortest=(2.0, 8.0), longest=(25.0, 60.0), **others):
    """Four-bar arms of random lengths near each other, bodies on every link, two heights, and an obstacle."""
    bodies = (
        Body(np.array([[-3.0, 0.0], [30.0, 0.5]]), 1.0, "beta", category="high", meets=("high",), name="probe"),
        Body(rng.normal(0, 4, (n, 3, 2)), rng.uniform(0.2, 1.5, n), "rocker", category="low", meets=("low", "high")),
        Body(STAR, 0.3, "alpha", closed=True, category="low", meets=("low",), name="star"),
        Body(np.array([[2.0, 1.0]]), 1.0, "base", category="low", meets=("low",), name="foot"),
    )
    bar = FourBar(
        spacing=rng.uniform(8, 25, n),
        rocker=rng.uniform(4, 15, n),
        shortest=rng.uniform(*shortest, n),
        longest=rng.uniform(*longest, n),
        orientation=rng.uniform(-4, 4, n),
    )
    length, zero = rng.uniform(4, 15, n), rng.uniform(-1, 1, (n, 2))
    folded = np.zeros((n, 2))
    for i in range(n):  # any configuration whose slider is well in range
        for k in itertools.count():
            folded[i] = np.random.default_rng(k).uniform(0, 2 * np.pi, 2)
            slider = bar.sliders(length, folded, zero)[i]
            if bar.shortest[i] + 1 < slider < bar.longest[i] - 1:
                break
            if k > 500:
                raise ValueError("no configuration outside the zone of avoidance")
    base = rng.uniform(-20, 20, (n, 2))
    post = Obstacle("post", rng.uniform(-30, 30, (1, 2)), 1.0)
    fields = {"folded": folded, "zero": zero, "kinematics": bar, "fiber_offsets": {"tip": np.array([30.0, 0.5])}}
    return make_plane(base, bodies, (post,), length=length, **(fields | others))


def cells_clear(plane, i, start, margin, size):
    """Clearance at the middle of each cell of positioner i's joint ranges, to what never moves, less the margin.

    Returns:
        (excess (a, b) [mm], most that any body point moves between the middle of a cell and any other place in it
        [mm], lower ends (2,) [rad], widths (2,) [rad]).
    """
    low, high = plane.lower[i], plane.upper[i]
    count = np.maximum(1, np.ceil((high - low) / size)).astype(int)
    width = (high - low) / count
    alpha, beta = (low[d] + (np.arange(count[d]) + 0.5) * width[d] for d in (0, 1))
    poses = np.stack(np.meshgrid(alpha, beta, indexing="ij"), axis=-1).reshape(-1, 2)
    excess = np.full(len(poses), np.inf)
    for j in range(plane.n + len(plane.obstacles)):
        if j != i and (j >= plane.n or not plane.online[j]):
            other = np.tile(start[j] if j < plane.n else np.zeros(2), (len(poses), 1))
            excess = np.minimum(excess, sampled_clearance(plane, i, j, poses, other) - margin)
    about_base = about_elbow = 0.0
    for body in plane.bodies:
        far = np.linalg.norm(body.points[i] if body.points.ndim == 3 else body.points, axis=1).max()
        if body.link == "beta":
            about_base, about_elbow = max(about_base, plane.length[i] + far), max(about_elbow, far)
        elif body.link == "alpha":
            about_base = max(about_base, far)
    return excess.reshape(count), 0.5 * (about_base * width[0] + about_elbow * width[1]), low, width


def path_past_fixed(plane, i, start, goal, margin, size=0.02):
    """Whether positioner i can come from start to goal past what never moves, by floods over cells of about `size`.

    Returns:
        True if cells that are free as a whole join both, False if not even cells do that may be free in part, None
        if neither.
    """
    excess, within, low, width = cells_clear(plane, i, start, margin, size)

    def joined(free, structure):
        cells, _ = label(free, structure=structure)
        at = [cells[tuple(np.clip(((q - low) / width).astype(int), 0, np.array(free.shape) - 1))] for q in ends]
        return bool(at[0] == at[1] > 0)

    ends = (start[i], goal)
    if joined(excess - within - 1e-6 >= 0, None):
        return True
    return None if joined(excess + within + 1e-6 >= 0, np.ones((3, 3))) else False


def motion_of(*knots):
    """A trajectory from one list of (time, alpha, beta) per positioner."""
    rows = np.array([row for own in knots for row in own], float)
    return Trajectory(np.concatenate([[0], np.cumsum([len(own) for own in knots])]), rows[:, 0], rows[:, 1:])


STAR = np.array([[(3.0 if k % 2 else 1.2) * f(k * np.pi / 5) for f in (np.cos, np.sin)] for k in range(10)])


def varied_plane(rng, n=3, obstacles=True):
    """Positioners near each other with bodies of every kind on every link, at three heights, and obstacles."""
    hull = np.array([[-1.0, -1.5], [7.0, -2.0], [12.0, 0.0], [6.0, 2.5], [-1.0, 1.0]])
    bodies = (
        Body(np.array([[0.0, 0.0], [14.0, 0.5]]), rng.uniform(0.2, 1.5, n), category="low", meets=("low", "post")),
        Body(hull, 0.3, closed=True, category="high", meets=("high",)),
        Body(STAR * 1.2 + [9.0, 0.0], 0.0, closed=True, category="top", meets=("top",)),
        Body(rng.normal(0, 3, (n, 4, 2)) + np.array([5.0, 0.0]), 0.4, link="alpha", category="low", meets=("low",)),
        Body(np.array([[0.0, 0.0]]), 1.0, link="base", category="post", meets=()),
    )
    fixed = (
        Obstacle("disc", rng.uniform(-15, 15, (1, 2)), 1.0),
        Obstacle("wall", rng.uniform(-25, 25, (3, 2)), 0.5, meets=("low", "high")),
        Obstacle("camera", STAR * 2 + rng.uniform(-20, 20, 2), 0.1, closed=True, meets=("high", "top")),
    )
    return make_plane(
        rng.uniform(-14, 14, (n, 2)),
        bodies,
        fixed if obstacles else (),
        length=rng.uniform(2.0, 9.0, n),
        zero=rng.uniform(-3, 3, (n, 2)),
    )


def brute_pairs(position, reach, gap):
    """Pairs (m, 2) of circles that come within `gap` of touching, all compared with all."""
    near = np.linalg.norm(position[:, None] - position[None], axis=2) < reach[:, None] + reach[None] + gap
    return np.argwhere(np.triu(near, 1))


def brute_boxes(position, reach, box, gap):
    """(circle, box) (m, 2) that come within `gap` of touching, all compared with all."""
    outside = np.maximum(box[:, None, :2] - position[None], position[None] - box[:, None, 2:]).clip(min=0)
    return np.argwhere(np.linalg.norm(outside, axis=2) < reach + gap)[:, ::-1]
