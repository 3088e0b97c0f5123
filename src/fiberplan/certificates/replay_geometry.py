"""Which geometry a replay is about, in words and as a digest that people can compare with that of `fiberplan verify`.

The digest is that of `fiberplan.focal_plane.geometry`, made anew from the tables of a plan file: arms, ranges, speeds,
bodies with what they meet, and obstacles, to the last bit. Names of bodies are no part of it.
"""

import hashlib
import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from fiberplan.certificates.replay import BAR, Claims, Shape, columns

_SHOWN = 12  # digits that people compare
_JOINTS = ("zero", "lower", "upper", "max_speed")


def geometry_fault(claims: Claims) -> Iterator[str]:
    """A fault if the certificate says that it is about another geometry than the file holds."""
    stated = (claims.said["certificate"].get("geometry") or {}).get("digest")  # files of earlier versions say nothing
    if stated not in (None, digest(claims)):
        yield "the certificate is about another geometry than the file holds"


def digest(claims: Claims) -> str:
    """SHA-256 of the geometry, hexadecimal."""
    hashed, table = hashlib.sha256(b"fiberplan geometry 1\n"), claims.table

    def words(*said: Any) -> None:
        hashed.update(json.dumps(said).encode() + b"\n")

    def array(name: str, values: Any) -> None:
        words(name, np.shape(values))
        hashed.update((np.ascontiguousarray(values, "<f8") + 0.0).tobytes())

    words(*(id_.decode() for id_ in table["positioner"].tolist()))
    array("base", columns(table, "base_x", "base_y"))
    array("length", columns(table, "length")[:, 0])
    for name in _JOINTS:
        array(name, columns(table, f"{name}_alpha", f"{name}_beta"))
    for name in BAR if claims.bar.size else ():
        array(name, columns(table, name)[:, 0])
    for key, link, shapes in _bodies(claims):
        closed = bool(key["closed"] == b"T")
        words(link, closed, shapes[0].category, None if shapes[0].meets is None else sorted(shapes[0].meets))
        points = np.stack([np.stack([s.points.real, s.points.imag], axis=1) for s in shapes])
        radii = np.array([s.radius for s in shapes])
        array("points", points[0] if (points == points[0]).all() else points)
        array("radius", radii[0] if (radii == radii[0]).all() else radii)
    return hashed.hexdigest()


def about(claims: Claims) -> str:
    """The geometry in words, with the beginning of its digest, and the margin."""
    bodies = []
    for first, _, shapes in _bodies(claims)[: len(claims.arms[0])]:
        radii = dict.fromkeys(
            f"{radius:.6g}" for radius in (min(s.radius for s in shapes), max(s.radius for s in shapes))
        )
        meets = "everything" if shapes[0].meets is None else ", ".join(sorted(shapes[0].meets)) or "nothing"
        bodies.append(f"{first['name'].decode()} of radius {' to '.join(radii)} mm (meets {meets})")
    count = len(claims.arms) - claims.n
    obstacles = f"{count} obstacle{'' if count == 1 else 's'}"
    what = ", ".join((f"{claims.n} positioners", *(bodies or ["no bodies"]), obstacles))
    name = claims.tables["FOCALPLANE"]["name"][0].decode()
    return f"{name}: {what}; digest {digest(claims)[:_SHOWN]}; margin {claims.margin:g} mm"


def _bodies(claims: Claims) -> list[tuple[Any, str, list[Shape]]]:
    """(a row, link, the shape that each arm has) of each body, then of each obstacle."""
    bodies, obstacles = claims.tables["BODIES"], claims.tables["OBSTACLES"]
    found = []
    for k in range(len(claims.arms[0])):
        row = bodies[np.argmax(bodies["body"] == k)]
        found.append((row, row["link"].decode(), [claims.arms[i][k] for i in range(claims.n)]))
    for k in range(len(claims.arms) - claims.n):
        found.append((obstacles[np.argmax(obstacles["obstacle"] == k)], "fixed", claims.arms[claims.n + k]))
    return found
