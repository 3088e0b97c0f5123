"""Where two descriptions of the same array differ."""

from collections.abc import Iterator, Sequence

import numpy as np

from fiberplan.errors import InstrumentError
from fiberplan.focal_plane.bodies import Body, Obstacle
from fiberplan.focal_plane.focal_plane import FocalPlane

_SHOWN = 4  # positioners that an error lists
_MEASURES = {"base": "mm", "length": "mm", "zero": "deg", "folded": "deg", "lower": "deg", "upper": "deg"}
_MEASURES |= {"max_speed": "deg/s"}
_LIMITS = {"max_acceleration": "deg/s^2", "min_speed": "deg/s"}


def on_the_other(own: FocalPlane, other: FocalPlane) -> FocalPlane:
    """`other`, its positioners in the order of `own`; nobody can move who cannot in both.

    Raises:
        InstrumentError: positioners that only one of them has; they are named.
    """
    for one, two in ((own, other), (other, own)):
        lacking = [id_ for id_ in one.ids if id_ not in two.names]
        if lacking:
            more = f" and {len(lacking) - _SHOWN} more" if len(lacking) > _SHOWN else ""
            raise InstrumentError(f"{two.name}: has no positioner {', '.join(lacking[:_SHOWN])}{more}, {one.name} has")
    placed = other.subset(np.array([other.names[id_] for id_ in own.ids]))
    return placed.replace(online=placed.online & own.online)


def differences_of(own: FocalPlane, other: FocalPlane) -> Iterator[str]:
    """A sentence for each thing in which `own` is not as `other`, whose positioners are in the same order."""
    for name, unit in (_MEASURES | _LIMITS).items():
        one, two = (plane.limit(name) if name in _LIMITS else getattr(plane, name) for plane in (own, other))
        off = np.abs(np.subtract(one, two, where=one != two, out=np.zeros_like(one))).reshape(own.n, -1).max(axis=1)
        if (off > 0).any():
            worst = int(np.argmax(off))
            most = float(np.degrees(off[worst]) if unit.startswith("deg") else off[worst])
            count = int((off > 0).sum())
            yield f"{name} of {count} positioners, by {most:.6g} {unit} at most ({own.ids[worst]})"
    for name in sorted({*own.fiber_offsets} ^ {*other.fiber_offsets}):
        yield f"only one has the fiber '{name}'"
    for name in sorted({*own.fiber_offsets} & {*other.fiber_offsets}):
        one, two = own.fiber_offsets[name], other.fiber_offsets[name]
        if not np.array_equal(one, two, equal_nan=True):
            yield f"the fiber '{name}', by {np.nanmax(np.abs(one - two), initial=0.0):.6g} mm at most"
    yield from _outlines("bodies", own.bodies, other.bodies)
    yield from _outlines("obstacles", own.obstacles, other.obstacles)


def _outlines(
    what: str, own: Sequence[Body] | Sequence[Obstacle], other: Sequence[Body] | Sequence[Obstacle]
) -> Iterator[str]:
    """Sentences for outlines that are not the same."""
    if len(own) != len(other):
        yield f"{len(own)} {what}, not {len(other)}"
        return
    for first, second in zip(own, other, strict=True):
        name = str(getattr(first, "name", "")) or f"one of the {what}"
        for part, measure in (("outline", "points"), ("radius", "radius")):
            one, two = np.asarray(getattr(first, measure)), np.asarray(getattr(second, measure))
            if one.shape != two.shape:
                yield f"the {part} of {name} has another number of values"
            elif (one != two).any():
                yield f"the {part} of {name}, by {float(np.abs(one - two).max()):.6g} mm at most"
