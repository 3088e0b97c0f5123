"""Faults planted into motions that are safe, as files tell them: robot -> alpha and beta -> points [deg, s]."""

import copy

import numpy as np

import fiberplan as fp

AXES = ("alpha", "beta")


def faulty(sent, rng):
    """The same with one fault, and whose: a knot moved, two robots exchanged, or a robot late."""
    made = dict(sent)
    first, second = (str(name) for name in rng.choice(list(made), 2, replace=False))
    kind = rng.integers(3)
    if kind == 1:
        made[first], made[second] = made[second], made[first]
        return made, (first, second)
    made[first] = copy.deepcopy(sent[first])
    if kind == 0:
        points = made[first][AXES[rng.integers(2)]]
        points[rng.integers(len(points))][0] += float(rng.normal(0.0, 60.0))
    else:
        late = float(rng.uniform(1.0, 15.0))
        for points in made[first].values():
            for point in points:
                point[1] += late
    return made, (first,)


def as_table(sent):
    """The same as a table, a row a point of an axis."""
    lines = ["positioner,time,alpha,beta"]
    for name, axes in sent.items():
        rows = sorted((point[1], k, point[0]) for k, axis in enumerate(AXES) for point in axes[axis])
        lines += [f"{name},{time!r},{'' if k else repr(angle)},{repr(angle) if k else ''}" for time, k, angle in rows]
    return "\n".join(lines) + "\n"


def told(plane, sent):
    """The motion that it tells, read by three lines of our own; who is not told of rests folded."""
    knots = {i: (np.zeros(1), plane.folded[i : i + 1]) for i in range(plane.n)}
    for name, axes in sent.items():
        points = [np.array(axes[axis]) for axis in AXES]
        times = np.unique(np.concatenate([axis[:, 1] for axis in points]))
        angles = np.stack([np.interp(times, axis[:, 1], axis[:, 0]) for axis in points], axis=1)
        knots[plane.names[name]] = times, np.radians(angles)
    owner = np.repeat(np.arange(plane.n), [len(knots[i][0]) for i in range(plane.n)])
    times, angles = (np.concatenate([knots[i][k] for i in range(plane.n)]) for k in (0, 1))
    return fp.Trajectory.from_knots(owner, times, angles, plane.n)
