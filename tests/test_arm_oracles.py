"""Frames, points and motion bounds of arms against complex numbers in numpy, with the compiler off."""

import numpy as np
import pytest

from fiberplan.focal_plane.bodies import Body
from fiberplan.kernels.arms import acceleration, frame, motion, point, vertex
from fiberplan.tolerances import ZONE
from references import four_bar_joints, four_bar_plane, make_plane, placed, varied_plane


def far(plane, i, link):
    """Farthest body point of a link of positioner i from the origin of the link's frame [mm], less radii."""
    own = [b.points[i] if b.points.ndim == 3 else b.points for b in plane.bodies if b.link == link]
    return max((np.linalg.norm(p, axis=1).max() for p in own), default=0.0)


def bound_of_motion(plane, i, da, db):
    """`motion`, as its docstring and design/four-bar.md define it."""
    if plane.arms.arm[i]["bar"] < 0:
        beta = plane.length[i] * abs(da) + far(plane, i, "beta") * abs(da + db)
        return max(beta, far(plane, i, "alpha") * abs(da))
    bar = plane.kinematics
    swing, rock = plane.length[i] * abs(da), bar.rocker[i] * abs(db)
    probe = swing + far(plane, i, "beta") * (swing + rock) / (bar.shortest[i] - ZONE)
    return max(probe, far(plane, i, "alpha") * abs(da), far(plane, i, "rocker") * abs(db))


def arms_of_all_kinds():
    for seed in range(4):
        rng = np.random.default_rng(seed)
        yield rng, varied_plane(rng)
        yield rng, four_bar_plane(rng)


def test_vertices_of_every_link():
    for rng, plane in arms_of_all_kinds():
        for _ in range(5):
            i, q = int(rng.integers(plane.n)), rng.uniform(-7, 7, 2)
            frame_, arm = frame(plane.arms, i, *q), plane.arms.arm[i]
            found = {0: [], 1: [], 2: [], 3: []}
            for p in range(arm["first_piece"], arm["last_piece"]):
                piece = plane.arms.piece[p]
                found[piece["link"]] += [
                    vertex(plane.arms, frame_, piece["link"], k) for k in range(piece["first"], piece["last"])
                ]
            for link, name in enumerate(("base", "alpha", "beta", "rocker")):
                shapes = [placed(plane, i, b, q[None])[0] for b in plane.bodies if b.link == name]
                if shapes:  # outlines may be cut into pieces, but of the same points
                    expected = np.unique(np.round(np.concatenate(shapes), 9) + 0.0, axis=0)
                    np.testing.assert_allclose(
                        np.unique(np.round(found[link], 9) + 0.0, axis=0), expected, atol=3e-9, err_msg=name
                    )


def test_frames():
    for rng, plane in arms_of_all_kinds():
        for _ in range(5):
            i, q = int(rng.integers(plane.n)), rng.uniform(-7, 7, 2)
            bx, by, ex, ey, c1, s1, c2, s2, jx, jy, c3, s3 = frame(plane.arms, i, *q)
            assert (bx, by) == tuple(plane.base[i])
            if plane.arms.arm[i]["bar"] >= 0:
                j1, j2, j3, j4 = four_bar_joints(plane, i, q[None])
                j3, j4 = j3[0], j4[0]
                assert complex(jx, jy) == pytest.approx(j2)
                assert complex(ex, ey) == pytest.approx(j3)
                assert complex(c3, s3) == pytest.approx((j4 - j2) / abs(j4 - j2))
                assert complex(c1, s1) == pytest.approx((j3 - j1) / abs(j3 - j1))
                assert complex(c2, s2) == pytest.approx((j4 - j3) / abs(j4 - j3))
            else:
                first = q[0] + plane.zero[i, 0]
                second = first + q[1] + plane.zero[i, 1]
                assert complex(c1, s1) == pytest.approx(np.exp(1j * first))
                assert complex(c2, s2) == pytest.approx(np.exp(1j * second))
                assert complex(ex, ey) == pytest.approx(complex(bx, by) + plane.length[i] * np.exp(1j * first))
                assert (jx, jy, c3, s3) == (0.0, 0.0, 0.0, 0.0)
            origin = {0: bx + 1j * by, 1: bx + 1j * by, 2: ex + 1j * ey, 3: jx + 1j * jy}
            turn = {0: 1.0, 1: c1 + 1j * s1, 2: c2 + 1j * s2, 3: c3 + 1j * s3}
            for link in range(4):
                u, v = rng.normal(0, 5, 2)
                x, y = point((bx, by, ex, ey, c1, s1, c2, s2, jx, jy, c3, s3), link, u, v)
                assert complex(x, y) == pytest.approx(origin[link] + turn[link] * complex(u, v))


def test_motion_bound_is_the_one_defined():
    for rng, plane in arms_of_all_kinds():
        for _ in range(12):
            i, step = int(rng.integers(plane.n)), rng.normal(0, 1, 2) * rng.choice([0.1, 1, 1, 0], 2)
            assert motion(plane.arms, i, *step) == pytest.approx(bound_of_motion(plane, i, *step), rel=1e-12)
        for k in range(len(plane.obstacles)):
            assert motion(plane.arms, plane.n + k, 1.0, 1.0) == 0.0
            assert acceleration(plane.arms, plane.n + k, 1.0, 1.0) == 0.0


def test_motion_bound_holds_and_is_attained():
    for rng, plane in arms_of_all_kinds():
        if plane.kinematics.has_avoidance:
            continue
        i, start, step = int(rng.integers(plane.n)), rng.uniform(-4, 4, 2), rng.normal(0, 1, 2)
        angles = start + np.linspace(0, 1, 40)[:, None] * step
        moved = max(
            np.linalg.norm(t - t[:1], axis=2).max() for t in (placed(plane, i, b, angles) for b in plane.bodies)
        )
        assert moved <= motion(plane.arms, i, *step) + 1e-9
    for body, turns in (
        (Body(np.array([[10.0, 0.0]]), 1.0), (1e-4, 0.0)),
        (Body(np.array([[0.0, 0.0], [10.0, 0.0]]), 1.0), (0.0, -1e-4)),
        (Body(np.array([[30.0, 0.0]]), 1.0, link="alpha"), (1e-4, -1e-4)),
    ):
        plane = make_plane([0, 0], [body, Body(np.zeros((1, 2)), 1.0)], length=5.0)
        angles = np.array([[0.3, 0.0], np.add([0.3, 0.0], turns)])
        moved = max(np.linalg.norm(np.diff(placed(plane, 0, b, angles), axis=0), axis=2).max() for b in plane.bodies)
        assert moved == pytest.approx(motion(plane.arms, 0, *turns), rel=1e-6)


def test_acceleration_is_the_one_defined_and_holds():
    h = 1e-4
    for rng, plane in arms_of_all_kinds():
        if plane.kinematics.has_avoidance:
            continue
        for _ in range(8):
            i, start, speed = int(rng.integers(plane.n)), rng.uniform(-4, 4, 2), rng.uniform(-2, 2, 2)
            beta = plane.length[i] * speed[0] ** 2 + far(plane, i, "beta") * speed.sum() ** 2
            bound = acceleration(plane.arms, i, *speed)
            assert bound == pytest.approx(max(beta, far(plane, i, "alpha") * speed[0] ** 2), rel=1e-12)
            for body in plane.bodies:
                before, now, after = placed(plane, i, body, start + np.array([[-h], [0.0], [h]]) * speed)
                assert np.linalg.norm(before - 2 * now + after, axis=1).max() / h**2 <= bound + 1e-4
