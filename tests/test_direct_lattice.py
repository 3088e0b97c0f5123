"""Lattices of the direct planner, what neighbours block of them, and searches over them, against plain references."""

from collections import deque
from itertools import product

import numpy as np
import pytest

import fiberplan as fp
from fiberplan.arrays import read_only
from fiberplan.focal_plane.bodies import Obstacle
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.kernels.arms import frame
from fiberplan.kernels.clearance import clearance
from fiberplan.kernels.compile import kernel, leaf
from fiberplan.planners.direct.blocked_nodes import beta_motion, blocked_betas, link_directions, mark_blocked
from fiberplan.planners.direct.contacts import find_contacts, steps_in_contact
from fiberplan.planners.direct.joint_nodes import forget_clear, joint_words, look
from fiberplan.planners.direct.lattice import lengthened, make_lattice, refined, window, window_of
from fiberplan.planners.direct.nodes import MOST_BETAS, step_length
from fiberplan.planners.direct.pairs import kept_apart, move_jointly, steps_alone
from fiberplan.planners.direct.past_fixed import steps_past_fixed
from fiberplan.planners.direct.remembered import blocked_cells
from fiberplan.planners.direct.scratch import TABLE, make_scratch
from fiberplan.planners.direct.single import replan
from fiberplan.planners.direct.trim import as_trajectory
from fiberplan.scenes.decisive import exchange
from fiberplan.scenes.uniform import uniform_field
from fiberplan.tolerances import SLACK, UNDER_LIMIT
from problems import narrow_exchange

DEG = np.pi / 180.0
NOTHING = np.uint64(0)  # no beta nodes


def row_of(n, pitch=22.4, **changes):
    """Positioners in a row along x, with joint ranges small enough to enumerate."""
    plane = fp.FocalPlane.hexagonal(3, pitch, **changes)
    return plane.subset(np.flatnonzero(np.abs(plane.base[:, 1]) < 1e-9)[:n])


def two_arms():
    """Two arms of a few nodes each that face each other."""
    plane = row_of(2, lower=np.radians([0.0, 60.0]), upper=np.radians([180.0, 180.0]), folded=np.radians([0.0, 180.0]))
    start = np.radians([[0.0, 120.0], [180.0, 120.0]])
    goal = np.radians([[60.0, 120.0], [120.0, 120.0]])
    return plane, start, goal


def lattice_of(plane, start, goal, turn, steps):
    length = step_length(plane, start, goal, turn)
    return make_lattice(plane, start, goal, plane.online, length.longest, steps, length.widest)


def nodes_of(lattice, i):
    """(steps + 1, 2) the nodes that positioner i passes."""
    own = [nodes[i, : lattice.size[i, d]] for d, nodes in enumerate((lattice.alpha, lattice.beta))]
    return np.stack([np.searchsorted(own[d], lattice.path[i, :, d]) for d in (0, 1)], axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_nodes_hold_both_ends_and_respect_speeds(seed):
    plane = fp.FocalPlane.hexagonal(3, 22.4)
    rng = np.random.default_rng(seed)
    plane = plane.replace(max_speed=np.radians(rng.uniform(10.0, 40.0, (plane.n, 2))))
    start, goal = uniform_field(plane, seed), np.array(uniform_field(plane, seed + 50))
    goal[::7] = np.nan
    duration = step_length(plane, start, goal, 6 * DEG).longest
    lattice = make_lattice(plane, start, goal, plane.online, duration, 5, np.full(2, np.inf))
    for i, d in product(range(plane.n), (0, 1)):
        nodes = (lattice.alpha, lattice.beta)[d][i, : lattice.size[i, d]]
        assert np.all(np.diff(nodes) > 0)
        assert np.diff(nodes).max() <= plane.max_speed[i, d] * UNDER_LIMIT * duration * (1 + 1e-12)
        assert nodes[0] >= plane.lower[i, d]
        assert nodes[-1] <= plane.upper[i, d]
        assert nodes[lattice.first[i, d]] == start[i, d]
        if np.isnan(goal[i, 0]):
            assert lattice.last[i, d] == -1
        else:
            assert nodes[lattice.last[i, d]] == goal[i, d]
        # the way to the goal takes as many steps as its length asks for, the last one perhaps a short one
        if not np.isnan(goal[i, 0]):
            far = abs(goal[i, d] - start[i, d]) / (plane.max_speed[i, d] * UNDER_LIMIT * duration)
            assert abs(lattice.last[i, d] - lattice.first[i, d]) == int(np.ceil(far - 1e-9))
    assert lattice.size[:, 1].max() < MOST_BETAS


def test_a_wide_range_is_searched_around_the_move_only():
    plane = row_of(1, lower=(-np.inf, -np.inf), upper=(np.inf, np.inf), folded=(0.0, np.pi))
    start, goal = np.array([[0.0, 3.0]]), np.array([[0.1, 3.2]])
    lattice = lattice_of(plane, start, goal, 1 * DEG, 10)
    assert lattice.size[0, 1] < MOST_BETAS
    assert lattice.size[0, 0] <= 3 * MOST_BETAS


@kernel
def blocked_of(arms, lattice, i, j, limit, trig, out):
    link_directions(arms, lattice, i, trig)
    frame_j = frame(arms, j, lattice.path[j, 0, 0], lattice.path[j, 0, 1])
    for a in range(lattice.size[i, 0]):
        out[a] = blocked_betas(arms, lattice, i, a, trig, beta_motion(arms, lattice, i), j, frame_j, limit, NOTHING)


@pytest.mark.parametrize("margin", [0.0, 1.5])
def test_blocked_nodes_are_those_in_contact(margin):
    """Every bit of every node, for neighbours and obstacles, against the clearance there."""
    wall = Obstacle("wall", [[-30.0, 12.0], [30.0, 12.0], [30.0, 14.0], [-30.0, 14.0]], closed=True)
    plane = fp.FocalPlane.hexagonal(1, 22.4).replace(obstacles=(wall, Obstacle("post", [[8.0, -9.0]], 1.0)))
    start = np.radians(np.random.default_rng(2).uniform([0.0, 0.0], [360.0, 180.0], (plane.n, 2)))
    lattice = lattice_of(plane, start, np.full((plane.n, 2), np.nan), 9 * DEG, 1)
    scratch = make_scratch(lattice, 0)
    limit, found = margin + SLACK, 0
    for i, j in plane.arm_pairs_within(margin):
        blocked_of(plane.arms, lattice, i, j, limit, scratch.trig, scratch.row)
        for a, b in product(range(lattice.size[i, 0]), range(lattice.size[i, 1])):
            gap = clearance(
                plane.arms, i, lattice.alpha[i, a], lattice.beta[i, b], j, lattice.path[j, 0, 0], lattice.path[j, 0, 1]
            )
            assert bool((int(scratch.row[a]) >> b) & 1) == (not gap >= limit), (i, j, a, b, gap)
            found += not gap >= limit
    assert found > 100


@pytest.mark.parametrize(("name", "who"), [("moons", 500), ("desi", 2500)])
@pytest.mark.parametrize("seed", range(3))
def test_blocked_nodes_of_many_pieces(name, who, seed):
    """Seven zones at their heights, beta around nearly a whole turn; and concave outlines on both links."""
    plane = fp.FocalPlane.load(name)
    near = Neighbourhood.of(plane, 0.0)
    beside = near.near["arm"][near.offsets[who] : near.offsets[who + 1]]
    beside = sorted(beside[beside < plane.n], key=lambda j: np.hypot(*(plane.base[j] - plane.base[who])))[:8]
    rng = np.random.default_rng(seed)
    low, high = plane.lower, plane.upper
    start = low + rng.random((plane.n, 2)) * (high - low)
    lattice = lattice_of(plane, start, np.full((plane.n, 2), np.nan), 12 * DEG, 1)
    scratch = make_scratch(lattice, 0)
    found = 0
    for j in beside:
        blocked_of(plane.arms, lattice, who, j, SLACK, scratch.trig, scratch.row)
        for a, b in product(range(0, lattice.size[who, 0], 2), range(lattice.size[who, 1])):
            here = (lattice.alpha[who, a], lattice.beta[who, b])
            gap = clearance(plane.arms, who, *here, j, *start[j])
            assert bool((int(scratch.row[a]) >> b) & 1) == (not gap >= SLACK)
            found += not gap >= SLACK
    assert found > 10


@kernel
def remembered(arms, near, lattice, i, q, limit, steps, scratch):
    link_directions(arms, lattice, i, scratch.trig)
    motion = beta_motion(arms, lattice, i)
    return blocked_cells(arms, near, lattice, i, q, scratch.trig, motion, limit, steps, scratch.row, scratch.known)


@kernel
def marked(arms, near, lattice, i, q, limit, steps, scratch):
    link_directions(arms, lattice, i, scratch.trig)
    motion, j, pair = beta_motion(arms, lattice, i), near.near[q].arm, near.near[q].pair
    scratch.blocked[:] = NOTHING
    mark_blocked(arms, lattice, i, scratch.trig, motion, j, pair, limit, steps, scratch.row, scratch.blocked)


@pytest.mark.parametrize("room", [None, 900])
def test_what_is_remembered_is_what_would_be_found(room):
    """Paths, clearances, steps and goals change by chance; most questions are asked again; rings may be short."""
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    rng, near, steps = np.random.default_rng(3), Neighbourhood.of(plane, 1.0), 12
    start, goal = uniform_field(plane, 0, 1.0), uniform_field(plane, 1, 1.0)
    lattice = lattice_of(plane, start, goal, 15 * DEG, steps)
    scratch = make_scratch(lattice, len(near.near))
    if room:
        known = scratch.known
        scratch = scratch._replace(
            known=known._replace(questions=known.questions[:60].copy(), cells=known.cells[:room].copy())
        )
    again = 0
    for _ in range(600):
        i = int(rng.integers(2))
        q = int(rng.integers(near.offsets[i], near.offsets[i + 1]))
        change = int(rng.integers(20))
        if change == 0:
            j = int(rng.integers(plane.n))
            lattice.path[j] = start[j] + np.linspace(0.0, 1.0, steps + 1)[:, None] * (goal[j] - start[j]) * rng.random()
        elif change == 1:
            lattice.last[i] = -1 if lattice.last[i, 0] >= 0 else lattice.first[i]
        limit, count = (SLACK, 0.5)[change == 2], (steps, steps - 2)[change == 3]
        before = scratch.known.written[1]
        begin, end = remembered(plane.arms, near, lattice, i, q, limit, count, scratch)
        again += scratch.known.written[1] == before and end > begin
        marked(plane.arms, near, lattice, i, q, limit, count, scratch)
        expected = scratch.blocked[: count + 1]
        for k in range(1, count + 1):
            low, high = window(lattice, i, k, count)
            here = {
                int(cell["alpha"]): int(cell["betas"]) for cell in scratch.known.cells[begin:end] if cell["step"] == k
            }
            assert here == {a: int(expected[k, a]) for a in range(low, high + 1) if expected[k, a]}
    assert again > (100 if room is None else 0)
    assert room is None or scratch.known.written[1] > 2 * room


def test_only_nodes_that_can_be_reached_are_marked():
    """And of those all that touch."""
    plane = fp.FocalPlane.hexagonal(1, 22.4)
    near, steps = Neighbourhood.of(plane, 1.0), 14
    start, goal = uniform_field(plane, 0, 1.0), uniform_field(plane, 1, 1.0)
    lattice = lattice_of(plane, start, goal, 15 * DEG, steps)
    lattice.path[:] = start[:, None] + np.linspace(0.0, 1.0, steps + 1)[:, None] * (goal - start)[:, None]
    scratch, found, left = make_scratch(lattice, len(near.near)), 0, 0
    for i in range(plane.n):
        for q in range(near.offsets[i], near.offsets[i + 1]):
            j = int(near.near[q]["arm"])
            marked(plane.arms, near, lattice, i, q, 1.0, steps, scratch)
            for k in range(1, steps + 1):
                alphas, betas = (window_of(lattice, i, d, k, steps) for d in (0, 1))
                for a, b in product(range(alphas[0], alphas[1] + 1), range(lattice.size[i, 1])):
                    here = (lattice.alpha[i, a], lattice.beta[i, b])
                    touches = not clearance(plane.arms, i, *here, j, *lattice.path[j, k]) >= 1.0
                    reached = betas[0] <= b <= betas[1]
                    assert bool((int(scratch.blocked[k, a]) >> b) & 1) == (touches and reached)
                    found, left = found + (touches and reached), left + (touches and not reached)
    assert found > 100
    assert left > 10


@kernel
def replan_one(arms, near, lattice, i, weight, limits, scratch, extended, turn, steps):
    replan(arms, near, lattice, i, weight, limits, scratch, extended, turn, steps)


def cost_of(plane, lattice, near, i, way, weight, limits, extended, turn):
    """What a way (steps + 1, 2) of nodes costs positioner i, term by term."""
    total = 0.0
    for k in range(1, len(way)):
        (a, b), (c, d) = way[k], way[k - 1]
        total += turn * (abs(a - c) + abs(b - d)) + extended * (0.5 + 0.5 * np.cos(lattice.beta[i, b]))
        for near_k in near.near[near.offsets[i] : near.offsets[i + 1]]:
            j, pair = int(near_k["arm"]), int(near_k["pair"])
            here = (lattice.alpha[i, a], lattice.beta[i, b])
            gap = clearance(plane.arms, i, *here, j, lattice.path[j, k, 0], lattice.path[j, k, 1])
            total += weight[pair] * (not gap >= limits[pair])
    return total


def test_replanning_finds_the_cheapest_path():
    """Against every way there is, on a lattice small enough to list them."""
    plane, start, goal = two_arms()
    steps = 4
    lattice = lattice_of(plane, start, goal, 20 * DEG, steps)
    near = Neighbourhood.of(plane, 0.0)
    scratch = make_scratch(lattice, len(near.near))
    replan_one(plane.arms, near, lattice, 1, np.zeros(1, np.float32), np.zeros(1), scratch, 0.02, 0.01, steps)
    for price in (0.0, 0.3, 4.0):
        weight, limits = np.full(1, price, np.float32), np.full(1, SLACK)
        replan_one(plane.arms, near, lattice, 0, weight, limits, scratch, 0.02, 0.01, steps)
        settings = (weight, limits, 0.02, 0.01)
        found = cost_of(plane, lattice, near, 0, nodes_of(lattice, 0), *settings)
        first, last = tuple(lattice.first[0]), tuple(lattice.last[0])
        best = np.inf
        for moves in product(product((-1, 0, 1), repeat=2), repeat=steps):
            way = np.concatenate([[first], np.array(first) + np.cumsum(moves, axis=0)])
            if tuple(way[-1]) == last and np.all(way >= 0) and np.all(way < lattice.size[0]):
                best = min(best, cost_of(plane, lattice, near, 0, way, *settings))
        assert found == pytest.approx(best, abs=1e-4)


@pytest.mark.parametrize("pace", [1, 2])
def test_who_is_alone_takes_the_path_that_is_the_cheapest_of_all(pace):
    """Against the same search among neighbours whose contacts cost nothing, which looks at all nodes."""
    plane, steps = fp.FocalPlane.hexagonal(2, 22.4), 40
    start, goal = (np.array(uniform_field(plane, seed)) for seed in (0, 1))
    goal[3] = np.nan
    length, who = step_length(plane, start, goal, 9 * DEG), np.arange(plane.n)
    lattice = make_lattice(plane, start, goal, plane.online, length.longest, steps, length.widest)
    finer = np.full((plane.n, 2), pace)
    lattice = refined(lattice, plane, who, finer, start, goal, length.longest, steps, length.widest)
    near = Neighbourhood.of(plane, 0.0)
    nobody = near._replace(offsets=read_only(np.zeros_like(near.offsets), np.int64))
    scratch, nothing = make_scratch(lattice, len(near.near)), np.zeros(len(near.pairs), np.float32)
    for i in who:
        paths = []
        for lists in (near, nobody):
            replan_one(plane.arms, lists, lattice, i, nothing, np.zeros(len(near.pairs)), scratch, 0.02, 0.01, steps)
            paths.append(lattice.path[i].copy())
        np.testing.assert_array_equal(*paths)
        assert i == 3 or np.array_equal(paths[1][-1], goal[i])


def joint_steps(plane, lattice, limit, most):
    """Fewest steps in which both arms of a plane get to their goals, breadth first; None if never."""
    free = {}

    def is_free(node):
        if node not in free:
            angles = [
                lattice.alpha[0, node[0]],
                lattice.beta[0, node[1]],
                lattice.alpha[1, node[2]],
                lattice.beta[1, node[3]],
            ]
            free[node] = clearance(plane.arms, 0, *angles[:2], 1, *angles[2:]) >= limit
        return free[node]

    sizes = (*lattice.size[0], *lattice.size[1])
    start, end = (*lattice.first[0], *lattice.first[1]), (*lattice.last[0], *lattice.last[1])
    seen, queue = {start}, deque([(start, 0)])
    while queue:
        node, depth = queue.popleft()
        if node == end:
            return depth
        if depth == most:
            continue
        for move in product((-1, 0, 1), repeat=4):
            to = tuple(int(x + m) for x, m in zip(node, move, strict=True))
            if to not in seen and all(0 <= x < s for x, s in zip(to, sizes, strict=True)) and is_free(to):
                seen.add(to)
                queue.append((to, depth + 1))
    return None


@kernel
def alone(arms, near, lattice, i, j, limit, scratch, most):
    return steps_alone(arms, near, lattice, i, j, limit, limit, scratch, most)


@kernel
def together(arms, near, lattice, i, j, table, limits, respect, variety, scratch, steps, state):
    words = scratch.clear[0]
    forget_clear(lattice, i, j, table.steps, words, False)
    joint_words(lattice, i, j, steps, scratch.begins)
    return move_jointly(arms, near, lattice, i, j, words, table, limits, respect, variety, scratch, steps, state)


@leaf
def look_everywhere(arms, lattice, i, j, limit, words, steps, scratch, again):
    forget_clear(lattice, i, j, steps, words, again)
    apart = kept_apart(arms, lattice, i, j, limit, words, steps, scratch)
    for a in range(lattice.size[i, 0]):
        for b in range(lattice.size[i, 1]):
            for c in range(lattice.size[j, 0]):
                look(arms, lattice, i, a, b, j, c, apart)


def test_nodes_that_clear_by_less_are_where_those_that_clear_by_more_are_looked_for():
    problem = exchange()
    plane, steps, limit = problem.plane, 1000, 0.5
    lattice = lattice_of(plane, problem.start, problem.goal, 20 * DEG, 3)
    scratch = make_scratch(lattice, 0)
    scratch.clear[:] = 0
    for table, apart in enumerate([limit, 0.1]):
        look_everywhere(plane.arms, lattice, 0, 1, apart, scratch.clear[table], steps, scratch, False)
    assert np.any(scratch.clear[0] != scratch.clear[1])
    look_everywhere(plane.arms, lattice, 0, 1, limit, scratch.clear[1], steps, scratch, True)
    np.testing.assert_array_equal(scratch.clear[1], scratch.clear[0])
    size, alphas = lattice.size[0], lattice.size[1, 0]
    words = scratch.clear[0][: size[0] * size[1] * alphas].reshape(*size, alphas)
    held = 0
    for a, b, c, d in product(*(range(0, m, 2) for m in (*lattice.size[0], *lattice.size[1]))):
        here = (lattice.alpha[0, a], lattice.beta[0, b], 1, lattice.alpha[1, c], lattice.beta[1, d])
        clear = bool((int(words[a, b, c]) >> d) & 1)
        assert clear == (clearance(plane.arms, 0, *here) >= limit)
        held += not clear
    assert held > 10


@pytest.mark.parametrize("turn", [36.0, 30.0])
def test_pairs_need_as_many_steps_as_breadth_first_says(turn):
    as_breadth_first_says(exchange(), turn)


@pytest.mark.small
def test_pairs_in_narrow_ranges_too():
    as_breadth_first_says(narrow_exchange(), 45.0)


def as_breadth_first_says(problem, turn):
    plane, start, goal = problem.plane, problem.start, problem.goal
    lattice = lattice_of(plane, start, goal, turn * DEG, 3)
    scratch = make_scratch(lattice, 0)
    expected = joint_steps(plane, lattice, SLACK, 30)
    assert expected is not None
    assert alone(plane.arms, Neighbourhood.of(plane, 0.0), lattice, 0, 1, SLACK, scratch, 60) == expected
    assert alone(plane.arms, Neighbourhood.of(plane, 0.0), lattice, 1, 0, SLACK, scratch, 60) == expected
    single = int(np.abs(lattice.last - lattice.first).max())
    assert expected >= single
    for steps, possible in ((single - 1, False), (expected - 1, False), (expected, True), (expected + 3, True)):
        longer = lengthened(lattice, max(steps, lattice.steps))
        near = Neighbourhood.of(plane, 0.0)
        scratch = make_scratch(longer, len(near.near))
        state = np.array([1], np.uint64)
        table = np.array([(0, steps + 2, SLACK, 0)], TABLE)[
            0
        ]  # nodes that clear each other in more steps serve as well
        answer = together(plane.arms, near, longer, 0, 1, table, np.full(1, SLACK), 1.5, 0.5, scratch, steps, state)
        assert answer == possible
    nodes = np.stack([nodes_of(longer, i) for i in range(2)])
    np.testing.assert_array_equal(nodes[:, steps], lattice.last)
    for k in range(steps + 1):
        gap = clearance(plane.arms, 0, *longer.path[0, k], 1, *longer.path[1, k])
        assert gap >= SLACK
        if k:
            assert np.abs(nodes[:, k] - nodes[:, k - 1]).max() <= 1


def test_a_pair_that_never_gets_there():
    """Each is boxed in by the other for good."""
    plane = row_of(2, lower=np.radians([0.0, 0.0]), upper=np.radians([180.0, 20.0]), folded=np.radians([90.0, 0.0]))
    start, goal = np.radians([[90.0, 0.0], [100.0, 0.0]]), np.radians([[10.0, 0.0], [20.0, 0.0]])
    goal[1] = np.radians([179.0, 0.0])
    start[0], goal[0] = np.radians([80.0, 0.0]), np.radians([5.0, 0.0])
    goal[1], start[1] = np.radians([95.0, 0.0]), np.radians([175.0, 20.0])
    lattice = lattice_of(plane, start, goal, 10 * DEG, 2)
    expected = joint_steps(plane, lattice, SLACK, 200)
    found = alone(plane.arms, Neighbourhood.of(plane, 0.0), lattice, 0, 1, SLACK, make_scratch(lattice, 0), 200)
    assert found == (-1 if expected is None else expected)


@kernel
def past_fixed(arms, near, lattice, i, limit, scratch, most):
    return steps_past_fixed(arms, near, lattice, i, limit, scratch, most)


def test_ways_past_what_never_moves():
    """Around a post, the long way, or never where a second one closes that too."""
    plane = row_of(1)
    start, goal = np.radians([[60.0, 0.0]]), np.radians([[120.0, 0.0]])
    near_post = Obstacle("post", [[plane.base[0, 0], 18.0]], 1.0)
    expected = {}
    for name, posts in (("free", ()), ("post", (near_post,))):
        there = plane.replace(obstacles=posts)
        near = Neighbourhood.of(there, 0.0)
        lattice = lattice_of(there, start, goal, 6 * DEG, 2)
        expected[name] = past_fixed(there.arms, near, lattice, 0, SLACK, make_scratch(lattice, 0), 300)
    assert expected["free"] == np.abs(lattice.last - lattice.first).max()
    assert expected["post"] > expected["free"] + 10
    stiff = plane.replace(
        lower=np.radians([[0.0, 0.0]]), upper=np.radians([[360.0, 4.0]]), folded=np.radians([[0.0, 0.0]])
    )
    stiff = stiff.replace(obstacles=(near_post,))
    lattice = lattice_of(stiff, start, goal, 6 * DEG, 2)
    near = Neighbourhood.of(stiff, 0.0)
    assert past_fixed(stiff.arms, near, lattice, 0, SLACK, make_scratch(lattice, 0), 300) == -1


@kernel
def touching_steps(arms, path, i, j, limit, steps):
    return steps_in_contact(arms, path, i, j, limit, steps)


def test_contact_between_nodes_is_found():
    """Clear at every node and through each other in between; and what is called clear is, however densely sampled."""
    plane = row_of(2)
    path = np.zeros((2, 2, 2))
    path[0] = np.radians([[25.0, 0.0], [-25.0, 0.0]])
    path[1] = np.radians([[180.0, 180.0], [180.0, 180.0]])
    assert clearance(plane.arms, 0, *path[0, 0], 1, *path[1, 0]) > SLACK
    assert clearance(plane.arms, 0, *path[0, 1], 1, *path[1, 1]) > SLACK
    assert touching_steps(plane.arms, path, 0, 1, SLACK, 1) == (1, 0)
    rng = np.random.default_rng(0)
    cleared = 0
    for _ in range(300):
        path = np.radians(rng.uniform([0.0, 0.0], [360.0, 180.0], (2, 1, 2)) + rng.normal(0.0, 8.0, (2, 4, 2)))
        touching, ending = touching_steps(plane.arms, path, 0, 1, SLACK, 3)
        assert ending <= touching
        gaps = []
        for k, s in product(range(3), np.linspace(0.0, 1.0, 40)):
            at = (1.0 - s) * path[:, k] + s * path[:, k + 1]
            gaps.append(clearance(plane.arms, 0, *at[0], 1, *at[1]))
        if touching == 0:
            assert min(gaps) >= SLACK
            cleared += 1
        else:
            assert min(gaps) < SLACK + 0.05
    assert 50 < cleared < 300


def test_all_contacts_and_knots():
    problem = exchange()
    plane, start, goal = problem.plane, problem.start, problem.goal
    lattice = lattice_of(plane, start, goal, 12 * DEG, 20)
    for k in range(21):
        lattice.path[:2, k] = start + min(k, 10) / 10 * (goal - start)
    contacts = np.zeros(1, np.int64)
    find_contacts(plane.arms, lattice, np.array([[0, 1]]), np.arange(1), SLACK, 20, contacts)
    assert contacts[0] > 0
    motion = as_trajectory(lattice.path, 0.5)
    np.testing.assert_array_equal(np.diff(motion.offsets), [2, 2])
    assert motion.duration == 5.0
    np.testing.assert_allclose(motion.at(2.5), 0.5 * (start + goal))
