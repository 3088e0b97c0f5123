"""Contacts planted where a checker could miss them: `verify` has to tell each.

Arms stand in twos, each with an obstacle near, too far from others to matter. Two of each are brought at one moment to
a configuration whose clearance shapely knows, and the room that they are to keep is larger by the planted depth, down
to 1e-6 mm. They come from elsewhere and go on: slowly, or so fast that they touch for less than a millisecond; between
knots, or at a knot that both share; at times as of now, since 1970; with one that cannot move; one inside the other.
"""

import numpy as np

import fiberplan as fp
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.motion import Trajectory
from references import (
    STAR,
    clearance_over_time,
    four_bar_plane,
    sampled_clearance,
    smallest_over_time,
    varied_plane,
)

DEPTHS = (1e-6, 1e-6, 1e-4, 1e-2, 0.3)  #: [mm] how much nearer than they should they come
CLEAR = 5e-3  #: [mm] who stays clear by so much is not to be called unsafe
KINDS = ("between knots", "shared knot", "brief", "Unix time", "offline", "containment")
UNIX = 1.75e9  # [s]
APART = 400.0  # [mm] from two to two


def planted(rng: np.random.Generator, folder) -> None:
    """Fifteen twos: none of their contacts is missed."""
    there, missed = contacts(rng, 15)
    assert not missed, f"of {there} planted contacts these are missed: {missed}"


def contacts(rng, count):
    """How many contacts are planted among `count` twos, and (pair, kind, depth) of those that `verify` misses."""
    plane, motion, made = twos(rng, count)
    error = np.zeros(plane.n)
    for pair, (_, gap, depth) in made.items():
        error[pair[0]] = max(gap + depth, 0.0)
    told, past = found(plane, motion, error)
    made = {pair: (kind, depth) for pair, (kind, _, depth) in made.items() if not past.intersection(pair)}
    return len(made), [(pair, *what) for pair, what in made.items() if (pair[0], plane.public(pair[1])) not in told]


def spared(rng: np.random.Generator, folder) -> None:
    """Fifteen twos that stay clear by 5 um: none is called unsafe. They graze by 1e-6 mm: each is."""
    there, blamed, missed = alarms(rng, 15)
    assert not blamed, f"of {there} that stay clear these are called unsafe: {blamed}"
    assert not missed, f"of {there} that graze these are missed: {missed}"


def alarms(rng, count):
    """How many of `count` twos keep 5 um more than they have to, and (pair, kind, room) of those `verify` calls unsafe,
    and of those that it misses where they have to keep 1e-6 mm more than they do.

    How near they come is sampled, finer and finer. Where that has missed how near they are, which they are then shown
    to be by another look at the moment that `verify` names, nothing is counted.
    """
    plane, motion, made = twos(rng, count)
    error, least = np.zeros(plane.n), {}
    for pair in made:
        least[pair], _ = smallest_over_time(plane, motion, *pair, 300)
        error[pair[0]] = max(least[pair] - CLEAR - 10.0 ** rng.uniform(-9, 0), 0.0)
    told, past = found(plane, motion, error)
    kept = [pair for pair in made if error[pair[0]] > 0.0 and not past.intersection(pair)]
    blamed = []
    for i, arm in list(kept):
        contact = told.get((i, plane.public(arm)))
        if contact is None:
            continue
        near = clearance_over_time(plane, motion, i, arm, np.array([contact.time]))[0]
        if near < error[i] + CLEAR:
            kept.remove((i, arm))
        else:
            blamed.append(((i, arm), made[i, arm][0], error[i]))
    error[[i for i, _ in kept]] = [least[pair] + DEPTHS[0] for pair in kept]
    told, _ = found(plane, motion, error)
    missed = [(pair, made[pair][0], error[pair[0]]) for pair in kept if (pair[0], plane.public(pair[1])) not in told]
    return len(kept), blamed, missed


def found(plane, motion, error):
    """Contacts and undecided pairs by pair, and positioners past a zone of avoidance, of which nothing is claimed."""
    proof = fp.verify(plane, motion, position_error=error)
    told = {contact.pair: contact for contact in (*proof.contacts, *proof.undecided)}
    return told, {zone.positioner for zone in proof.zones}


def twos(rng, count):
    """Twos of arms and what stands near, a motion of all, and (kind, clearance, depth) of pairs that meet in it."""
    bars = bool(rng.random() < 0.25)
    plane = (four_bar_plane if bars else varied_plane)(rng, 2 * count)
    n, middle = plane.n, APART * np.arange(count)[:, None] * [1.0, 0.0]
    beside = middle + rng.uniform(-15, 15, (count, 2))
    shapes = (([[0.0, 0.0]], 1.0, False), ([[-3.0, 0.0], [4.0, 2.0], [4.0, 9.0]], 0.5, False), (2.0 * STAR, 0.1, True))
    posts = (shapes[rng.integers(3)] for _ in range(count))
    obstacles = (Obstacle(f"post {c}", np.add(p, beside[c]), r, closed) for c, (p, r, closed) in enumerate(posts))
    plane = plane.replace(
        base=np.repeat(middle, 2, axis=0) + rng.uniform(-10, 10, (n, 2)),
        obstacles=tuple(obstacles),
        max_speed=np.full((n, 2), 1e6),
    )
    online, knots, made = np.ones(n, bool), {}, {}
    for c in range(count):
        pair, kind = (2 * c, 2 * c + 1 if rng.random() < 0.7 else n + c), str(rng.choice(KINDS))
        there = _configuration(rng, plane, *pair, inside=kind == "containment")
        if there is None:
            continue
        (first, second), gap = there
        made[pair] = kind, gap, float(rng.choice(DEPTHS))
        if kind == "offline" and pair[1] < n:
            online[rng.choice(pair)] = False
        still = {k for k in pair if k >= n or not online[k]}
        knots |= _past(rng, bars, dict(zip(pair, (first, second), strict=True)), still, kind)
    whole = [knots.get(i, ([0.0], [plane.folded[i]])) for i in range(n)]
    owner = np.repeat(np.arange(n), [len(times) for times, _ in whole])
    times, angles = (np.concatenate([np.asarray(own[part], float) for own in whole]) for part in (0, 1))
    return plane.replace(online=online), Trajectory.from_knots(owner, times, angles, n), made


def _configuration(rng, plane, i, arm, inside):
    """Angles of both at which they are near, or one inside the other, and their clearance [mm]; None: not found."""
    turn = rng.uniform(-np.pi, np.pi, (2, 12, 2))
    if plane.kinematics.has_avoidance:  # small turns, so that sliders stay in their ranges
        turn = 0.15 * turn + np.stack([plane.folded[k] if k < plane.n else np.zeros(2) for k in (i, arm)])[:, None]
    gaps = sampled_clearance(plane, i, arm, *turn)
    near = np.flatnonzero(gaps < 0.0 if inside else (gaps > 0.0) & (gaps < 20.0))
    if not len(near):
        return None
    k = int(rng.choice(near))
    return turn[:, k], float(gaps[k])


def _past(rng, bars, through, still, kind):
    """Knots (times, angles) that take arms `through` configurations at one moment, but those that stand `still`."""
    at = UNIX if kind == "Unix time" else float(rng.uniform(4.0, 50.0))
    span = 2e-4 if kind == "brief" else float(rng.uniform(0.2, 3.0))
    knots = {}
    for k, angles in through.items():
        step = rng.normal(0.0, 0.02 if bars else 0.5, (2, 2))
        if k in still:
            knots[k] = [at], [angles]
        elif kind in ("shared knot", "Unix time", "brief"):
            knots[k] = [at - span, at, at + span], [angles + step[0], angles, angles + step[1]]
        else:  # in the middle of a straight piece
            knots[k] = [at - span, at + span], [angles - step[0], angles + step[0]]
    return knots
