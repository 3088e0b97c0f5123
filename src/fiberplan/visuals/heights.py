"""What may lie over what: kinds of bodies and obstacles that are never tested against each other, by their categories.

An arm drawn over a grey shape under a green verdict puzzles; this says which shapes keep their distance and which are
at another height.
"""

from dataclasses import dataclass

from fiberplan.focal_plane import FocalPlane
from fiberplan.focal_plane.bodies import Body, Obstacle


@dataclass(frozen=True)
class Kind:
    """Bodies or obstacles of one category that meet the same."""

    name: str
    count: int  #: obstacles of this kind; 1 of a body, which every positioner has
    meets: tuple[str, ...]  #: kinds that it keeps its distance from
    over: tuple[str, ...]  #: kinds that it may lie over or under


def meet(a: Body | Obstacle, b: Body | Obstacle) -> bool:
    """Whether two shapes of different arms can touch: if either meets the other."""
    if a.meets is None or b.meets is None:
        return True
    return b.category in a.meets or a.category in b.meets


def kinds(plane: FocalPlane) -> tuple[Kind, ...]:
    """Bodies, each a kind, then obstacles by category; obstacles are not told against each other."""
    fixed: dict[tuple, list[Obstacle]] = {}
    for obstacle in plane.obstacles:
        fixed.setdefault((obstacle.category, obstacle.meets), []).append(obstacle)
    shapes: list[tuple[str, int, Body | Obstacle]] = [(body.name, 1, body) for body in plane.bodies]
    bodies = len(shapes)
    shapes += [
        (group[0].name if len(group) == 1 else group[0].category, len(group), group[0]) for group in fixed.values()
    ]

    def told(k: int) -> Kind:
        name, count, shape = shapes[k]
        others = shapes if k < bodies else shapes[:bodies]
        met = [meet(shape, other) for _, _, other in others]
        names = [other for other, _, _ in others]
        return Kind(
            name,
            count,
            tuple(dict.fromkeys(n for n, yes in zip(names, met, strict=True) if yes)),
            tuple(dict.fromkeys(n for n, yes in zip(names, met, strict=True) if not yes)),
        )

    return tuple(map(told, range(len(shapes))))


def passed_over(plane: FocalPlane, obstacle: Obstacle) -> tuple[str, ...]:
    """Names of the bodies that may lie over an obstacle."""
    return tuple(dict.fromkeys(body.name for body in plane.bodies if not meet(body, obstacle)))
