"""The attraction of the repaired mode: by way of near its own base, and as late as the common time allows.

Descent of the printed potential goes straight, with the arm as far out as its target, through everyone else's zone.
Here a positioner that has time bends its second joint towards home (fully bent), where hardly anyone reaches, turns
there, and comes out so that it arrives when it is due. Going in and coming out, the first joint turns by `lean` times
the second, against it: at 0.5 the fiber of an equal-armed positioner heads straight for its base, at 0 and 1 it
passes on either side. Attraction acts on the joints, not on the fiber: it has no singular poses, respects joint
ranges because these are intervals, ends in the configuration that was asked for, and exactly there.
"""

import numpy as np

from fiberplan.focal_plane import FocalPlane
from fiberplan.kernels.compile import inlined, record
from fiberplan.planners.shared.step_limits import straight

WAY = record(
    [
        ("go", "f8"),  # step at which it may leave
        ("due", "f8"),  # step at which it should arrive
        ("lean_in", "f8"),
        ("lean_out", "f8"),
        ("rank", "f8"),  # who gives way to whom: the larger goes first; its own, or that of whom it helps
        ("own_rank", "f8"),
        ("turn_alpha", "f8"),  # what attraction asked for in the last step [rad]
        ("turn_beta", "f8"),
        ("was_alpha", "f8"),  # where it was then [rad]
        ("was_beta", "f8"),
        ("stalled", "i4"),  # steps without progress, less those with
        ("stalls", "i4"),  # how often it gave notice of that
        ("yields_to", "i4"),  # whom it makes room for, or -1
        ("until", "i4"),  # step at which it stops doing so in any case
        ("arrived", "?"),
        ("other_alpha", "f8"),  # its goal's other elbow solution [rad]; NaN: none
        ("other_beta", "f8"),
    ]
)
INNER = np.radians(40.0)  #: bent to within this of home, a fiber is where hardly anyone reaches
MIDDLE = 0.5  #: lean by which equal arms go straight through their base
FOREVER = 1e6  # [steps]


@inlined
def toward(d, most):
    """The part of a turn `d` that one step allows."""
    return min(max(d, -most), most)


@inlined
def home_of(end, beta):
    """The second joint bent as far as it goes, on the side on which it is [rad]."""
    folded = np.pi if beta + end.bend >= 0.0 else -np.pi
    return min(max(folded - end.bend, end.lower_beta), end.upper_beta)


@inlined
def leaning(end, alpha, lean, turned):
    """The first joint where the second has turned by so much from where alpha holds, within its range [rad]."""
    return min(max(alpha - lean * turned, end.lower_alpha), end.upper_alpha)


@inlined
def heading(end, way, alpha, beta, step):
    """The turns (d_alpha, d_beta) that attraction asks for in a step [rad]."""
    yields = way.yields_to >= 0
    anywhere = np.isnan(end.goal_alpha)
    if (anywhere or step < way.go) and not yields:
        return 0.0, 0.0
    home = home_of(end, beta)
    goal_alpha, goal_beta = (alpha, home) if anywhere else (end.goal_alpha, end.goal_beta)
    remaining = FOREVER if yields else way.due - step
    out = abs(goal_beta - beta) / end.most_beta  # steps
    if out <= 1.0 and abs(goal_alpha - alpha) <= end.most_alpha and not yields:
        return goal_alpha - alpha, goal_beta - beta
    goal_home = home_of(end, goal_beta)
    lean_out = way.lean_out if goal_home == home else 0.0
    aim = leaning(end, goal_alpha, lean_out, beta - goal_beta)
    behind = abs(aim - alpha) / end.most_alpha  # steps
    if remaining <= 0.0 and behind > 5.0:
        return straight(alpha, beta, goal_alpha, goal_beta, end.most_alpha, end.most_beta)
    leaves = out >= remaining - 1.0  # it is time to come out
    d_beta = 0.0
    if leaves:
        d_beta = toward(goal_beta - beta, end.most_beta)
    elif remaining - out >= 2.0:
        d_beta = toward(home - beta, end.most_beta)
    outside = abs(home - beta) - INNER
    if outside <= 0.0:
        return toward(aim - alpha, end.most_alpha), d_beta
    if leaves:
        if behind < 3.0:
            aim = leaning(end, goal_alpha, lean_out, beta + d_beta - goal_beta)
            return toward(aim - alpha, end.most_alpha), d_beta
        rest = goal_alpha - alpha
        return toward(rest, end.most_alpha) * min(1.0, abs(rest) / end.most_alpha / max(1.0, out)), d_beta
    # on the way in: lean, and turn already what there will be no time for inside
    inner = home + (INNER if beta > home else -INNER)
    steps_in = outside / end.most_beta
    steps_out = max(0.0, abs(goal_home - goal_beta) - INNER) / end.most_beta
    inside = max(0.0, remaining - steps_in - steps_out)
    rest = leaning(end, goal_alpha, lean_out, inner - goal_beta) - (alpha - way.lean_in * (inner - beta))
    need = max(0.0, abs(rest) / end.most_alpha - inside) / max(1.0, remaining - inside) * end.most_alpha
    return toward((need if rest > 0.0 else -need) - way.lean_in * d_beta, end.most_alpha), d_beta


def by_way_of_home(plane: FocalPlane, start: np.ndarray, choices: np.ndarray) -> np.ndarray:
    """(n, k) time to go home, turn there and come out to each of `choices` (n, k, 2) [s]; NaN where there is none.

    It is infinite for those on the other elbow side, to which no way leads through home.
    """
    bend = plane.zero[:, 1] + np.arctan2(plane.fiber[:, 1], plane.fiber[:, 0])

    def home(beta: np.ndarray, which: tuple) -> np.ndarray:
        folded = np.where(beta + bend[which] >= 0.0, np.pi, -np.pi) - bend[which]
        return np.clip(folded, plane.lower[:, 1][which], plane.upper[:, 1][which])

    row = (slice(None), None)
    begins, ends = home(start[:, 1], (slice(None),)), home(choices[:, :, 1], row)
    into, out = begins - start[:, 1], ends - choices[:, :, 1]  # turns of the second joint
    first = choices[:, :, 0] - MIDDLE * out - (start[:, 0] - MIDDLE * into)[:, None]
    second = np.maximum(np.abs(into)[:, None] - INNER, 0.0) + np.maximum(np.abs(out) - INNER, 0.0)
    times = second / plane.max_speed[:, 1][:, None] + np.abs(first) / plane.max_speed[:, 0][:, None]
    return np.where(ends == begins[:, None], times, np.where(np.isnan(times), np.nan, np.inf))


@inlined
def postponed(end, way, alpha, beta, step):
    """The step at which it can be due if it goes home, turns and comes out again."""
    steps_in = max(0.0, abs(home_of(end, beta) - beta) - INNER)
    steps_out = max(0.0, abs(home_of(end, end.goal_beta) - end.goal_beta) - INNER)
    if home_of(end, end.goal_beta) != home_of(end, beta):
        steps_out = abs(home_of(end, beta) - end.goal_beta)
    return step + (steps_in + steps_out) / end.most_beta + abs(end.goal_alpha - alpha) / end.most_alpha
