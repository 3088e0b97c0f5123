"""Uniform random targets, redrawn until none touch: the experiment of Sayres2021, from field to field.

Each seed has fields of its own: a problem goes from field 2 seed to field 2 seed + 1.
"""

from functools import cache, partial
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.scenes.uniform import uniform_field
from scenes.scene import Scene, margin_of

BUFFERS = {1.5: 20, 2.0: 20, 2.5: 50, 3.0: 50}  #: [mm] -> fields
PARKED = 10.0, 170.0  #: alpha and beta, in operation at SDSS-V [deg]
RINGS = {4_921: 40, 19_441: 80, 99_919: 182}


@cache  # one plane for all seeds, so that what a planner keeps of it stays warm
def sayres() -> fp.FocalPlane:
    return fp.FocalPlane.load("sayres2021")


@cache
def desi_like(n: int) -> fp.FocalPlane:
    """Equal links and the pitch of DESI, arms of 1 mm radius; 30 deg/s, since no figure here depends on the speed."""
    return fp.FocalPlane.hexagonal(RINGS[n], 10.4, lengths=(3.0, 3.0), radius=1.0, name="desi-like")


def _field_to_field(plane: fp.FocalPlane, margin: float, seed: int) -> fp.Problem:
    start, goal = (uniform_field(plane, number, margin) for number in (2 * seed, 2 * seed + 1))
    return fp.Problem(plane, start, goal, margin)


def field_to_field(seed: int, data: Path, buffer: float) -> fp.Problem:
    """547 arms of Sayres2021 from field to field."""
    return _field_to_field(sayres(), margin_of(buffer), seed)


def from_folded(seed: int, data: Path) -> fp.Problem:
    """547 arms of Sayres2021 from folded to a field, at a buffer of 2.0 mm."""
    plane, margin = sayres(), margin_of(2.0)
    return fp.Problem(plane, plane.folded, uniform_field(plane, seed, margin), margin)


@cache
def parked() -> fp.FocalPlane:
    """Parked where SDSS-V parks its robots: alphas have to turn both ways to get there."""
    return sayres().replace(folded=np.tile(np.radians(PARKED), (sayres().n, 1)))


def to_parked(seed: int, data: Path, buffer: float) -> fp.Problem:
    """547 arms of Sayres2021 from a field to where SDSS-V parks, (10, 170) deg."""
    plane, margin = parked(), margin_of(buffer)
    return fp.Problem(plane, uniform_field(plane, seed, margin), plane.folded, margin)


def hexagon(seed: int, data: Path, n: int) -> fp.Problem:
    """A filled hexagon of arms like DESI's, from field to field without margin."""
    return _field_to_field(desi_like(n), 0.0, seed)


def _named(function, text: str, **settings):
    """`function` with `settings`, and with what they are in its first line."""
    made = partial(function, **settings)
    made.__doc__ = f"{function.__doc__.rstrip('.')}{text}."
    return made


SCENES = (
    *(
        Scene(f"547-{b:.1f}", _named(field_to_field, f", at a buffer of {b:.1f} mm", buffer=b), fields)
        for b, fields in BUFFERS.items()
    ),
    Scene("547-from-folded", from_folded),
    *(
        Scene(f"547-park-{b:.1f}", _named(to_parked, f", at a buffer of {b:.1f} mm", buffer=b), fields=30)
        for b in (1.5, 2.0)
    ),
    *(Scene(f"desi-like-{n}", _named(hexagon, f": {n} of them", n=n), 20 if n < 50_000 else 3) for n in RINGS),
)
