"""Is the motion in a plan file safe, as its certificate says? The whole check, with nothing of fiberplan: read it.

It decides from positioners, motion and certificate alone (the argument is in ``docs/proof.md``) that

- pairs of which one can move are out of reach of each other, or are judged (`Claims.pairs`);
- the stated intervals cover a pair's motion, and all over each, every two convex parts that meet are kept apart by the
  margin and both position errors along an axis stated for it (`Claims.judge`); a pair that is said to begin nearer, by
  what it is said to begin with until it is said to have the margin (that it begins so: `replay_outcomes.py`).

Points are complex numbers x + iy. Within m +- h a coordinate f is, by the mean value theorem, in
f(m) + f'(m +- h) [-h, h]; both are evaluated with balls (python-flint) that enclose what rounding does. What is not
shown so is halved. A comparison that is not certain, of NaN too, counts against the claim.
"""

import hashlib
import io
import json
import math
from collections.abc import Callable, Iterator
from functools import partial, reduce
from itertools import chain, compress, pairwise, product
from typing import Any, NamedTuple

import numpy as np
from astropy.io import fits
from flint import acb, arb, ctx

ctx.prec = 96  # bits: rounding is far below all that is asked, at Unix times too
FORMAT = 3  # newest format of plan files that is known here
KINDS, UNITS = {"D": ">f8", "K": ">i8", "L": "S1"}, {"", "mm", "rad", "s", "rad/s", "rad/s2"}  # of columns
LINKS = {"base": 0, "alpha": 1, "beta": 2, "rocker": 3}
BAR = [f"four_bar_{name}" for name in ("spacing", "rocker", "shortest", "longest", "orientation")]
OPENING, MOST = 1e-6, 20_000  # what a pair that begins nearer may lose [mm]; halvings between two knots
FLOATS, QUARTER = 1e-7, acb(0, 1)  # more than floats lose, where no balls are used [mm]; a quarter turn


class BadFileError(ValueError):
    """The file is no plan that can be replayed; one line that says why."""


class Shape(NamedTuple):
    """A body of an arm, or an obstacle."""

    link: int
    points: np.ndarray  # (k,) complex [mm]
    parts: tuple  # vertices of each convex part: all of a filled convex outline, else those of an edge
    hollow: bool  # a filled outline that is not convex: only its edges are parts
    radius: float  # [mm]
    category: str
    meets: frozenset | None  # categories; None: all
    exact: list  # points as balls


def refuse(wrong: Any, why: str) -> None:
    """Raise `BadFileError` if something is wrong."""
    if wrong:
        raise BadFileError(why)


def kind(form: str) -> str:
    """A column's TFORM as numpy has it: text, numbers, or a few numbers a row."""
    count, code = form[:-1], form[-1:]
    return f"S{int(count)}" if code == "A" else f"({int(count)},){KINDS[code]}" if count else KINDS[code]


def read_tables(content: bytes) -> dict[str, np.ndarray]:
    """Tables by name, of the very bytes that the digest covers: no keyword of FITS can change what they say."""
    tables: dict[str, np.ndarray] = {}
    with fits.open(io.BytesIO(content), memmap=False, lazy_load_hdus=False, disable_image_compression=True) as hdul:
        version = hdul[0].header.get("FPFORMAT")
        refuse(type(version) is not int or not 1 <= version <= FORMAT, f"format {version}: 1 to {FORMAT} are read")
        hashed = hashlib.sha256(f"fiberplan {version}\n".encode())
        for hdu in hdul[1:]:
            rows, width, at = hdu.header["NAXIS2"], hdu.header["NAXIS1"], hdu.fileinfo()["datLoc"]
            keys = [[f"{key}{k + 1}" for key in ("TTYPE", "TFORM", "TUNIT")] for k in range(hdu.header["TFIELDS"])]
            made = [[str(hdu.header.get(key, "")) for key in three] for three in keys]
            lines = (f"{hdu.name} {rows}", *map(" ".join, made))
            hashed.update("".join(f"{line}\n" for line in lines).encode() + content[at : at + rows * width])
            dtype = np.dtype([(name, kind(form)) for name, form, _ in made])
            odd = hdu.name in tables or dtype.itemsize != width or not UNITS.issuperset(unit for *_, unit in made)
            refuse(odd, f"table {hdu.name} is there twice, or is none that fiberplan writes")
            tables[hdu.name] = np.frombuffer(content, dtype, rows, at)
        refuse(hashed.hexdigest() != hdul[0].header.get("FPSHA256"), "damaged: the data do not match their SHA-256")
    return tables


def columns(table: np.ndarray, *names: str) -> np.ndarray:
    """(rows, names) numbers in native byte order."""
    return np.stack([table[name].astype(float) for name in names], axis=1)


def shapes(table: np.ndarray, key: str, owners: int) -> Iterator[tuple[int, Shape]]:
    """(owner, shape) of each body, which -1 has for all positioners, or of each obstacle (`owners` is 0)."""
    owner, rows = table["positioner"] if owners else np.zeros(len(table), int), {}  # type: ignore[var-annotated]
    for k in np.lexsort((table["vertex"], owner, table[key])).tolist():
        rows.setdefault(int(table[key][k]), {}).setdefault(int(owner[k]), []).append(k)
    for number, of in enumerate(sorted(rows)):
        whole = list(rows[of]) in ([-1] * bool(owners), list(range(owners or 1)))
        refuse(number != of or not whole, f"{key} {number} is not there, or not of all positioners")
        for i, these in rows[of].items():
            own, first, count = table[these], table[these[0]], len(these)
            points, radius = own["x"].astype(float) + 1j * own["y"], float(first["radius"])
            same = ("radius", "closed", "category", "meets", "link")[: 5 if owners else 4]
            sides, meets = np.roll(points, -1) - points, json.loads(first["meets"])
            alike = all((own[name] == first[name]).all() for name in same) and type(meets) in (list, type(None))
            good = alike and (own["vertex"] == range(count)).all() and np.isfinite(points).all() and radius >= 0
            refuse(not good, f"{key} {number} has rows that contradict each other, or are no lengths")
            sides, closed = sides[sides != 0], bool(first["closed"] == b"T" and count > 2)
            around = np.abs(np.angle(np.roll(sides, -1) * sides.conj())).sum()  # 2 pi of the convex, more of others
            hull = count == 1 or (closed and bool((around - 2 * np.pi) * np.abs(sides).sum() < FLOATS))
            parts = (tuple(range(count)),) if hull else tuple((k, (k + 1) % count) for k in range(count - 1 + closed))
            said = radius, first["category"].decode(), meets if meets is None else frozenset(meets)
            link, exact = LINKS[first["link"].decode()] if owners else 0, [acb(z.real, z.imag) for z in points.tolist()]
            yield i, Shape(link, points, parts, closed and not hull, *said, exact)


def unit(angle: Any) -> Any:
    """The unit vector at an angle."""
    return acb(0, angle).exp()


def away(points: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Distance of points (m,) from a convex part (k,) [mm], to rounding; 0 within it."""
    along, beside = np.roll(part, -1) - part, points[:, None] - part
    place = beside * along.conj() / np.maximum(np.abs(along) ** 2, 1e-300)
    within = ((place.imag >= 0).all(axis=1) | (place.imag <= 0).all(axis=1)) & (len(part) > 2)
    return np.where(within, 0.0, np.abs(beside - np.clip(place.real, 0.0, 1.0) * along).min(axis=1))


def winds(outline: list, point: Any) -> bool:
    """Whether an outline may wind around a point, which then may lie within it."""
    return not abs(sum(((b - point) / (a - point)).arg() for a, b in pairwise([*outline, outline[0]]))) < 1


def everywhere(a: float, b: float, todo: list, look: Callable) -> bool:
    """Whether `look` shows all of `todo` in [a, b]: it tells what it does not in m +- h, and what is false at m."""
    waiting = [(a, b, todo)]
    for _ in range(MOST):
        if not waiting:
            return True
        a, b, todo = waiting.pop()
        m = 0.5 * (a + b) if 0.5 * (a + b) < b else a
        left, false = look(m, math.nextafter(max(m - a, b - m), math.inf), todo)
        if false or (left and not a < m):
            return False
        waiting += [(m, b, left), (a, m, left)] if left else []
    return False


class Claims:
    """What a plan file says, and whether it is so. Arms are positioners, then obstacles."""

    def __init__(self, content: bytes):
        try:
            self._take(read_tables(content))
        except Exception as error:  # readers of FITS and JSON raise what they like on a damaged file
            raise BadFileError(str(error) if isinstance(error, BadFileError) else "cannot be used as a plan") from None

    def _take(self, tables: dict[str, np.ndarray]) -> None:
        self.tables, self.table, self.problem, knots = tables, tables["POSITIONERS"], tables["PROBLEM"], tables["KNOTS"]
        self.n, self.said = len(self.table), json.loads(tables["PARAMETERS"]["json"][0])
        differ = any(self.table[k].tolist() != self.problem[k].tolist() for k in ("positioner", "outcome"))
        refuse(differ, "PROBLEM and POSITIONERS speak of other positioners or outcomes")
        self.online, fixed = self.table["online"] == b"T", [[s] for _, s in shapes(tables["OBSTACLES"], "obstacle", 0)]
        self.arms: list[list[Shape]] = [*([] for _ in range(self.n)), *fixed]
        for i, shape in shapes(tables["BODIES"], "body", self.n):
            for own in self.arms[: self.n] if i < 0 else self.arms[i : i + 1]:
                own.append(shape)
        self.place = columns(self.table, "base_x", "base_y", "length", "zero_alpha", "zero_beta")
        self.bar = columns(self.table, *BAR) if BAR[0] in str(self.table.dtype.names) else np.zeros((self.n, 0))
        self.margin, self.error = float(self.said["problem"]["margin"]), np.zeros(len(self.arms))
        if "position_error" in str(self.problem.dtype.names):
            self.error[: self.n] = self.problem["position_error"]
        lengths = np.array([self.margin, *self.error, *self.place[:, 2]])
        refuse(not (lengths >= 0).all(), "a length, the margin or a position error is not 0 or more")
        owner, every = knots["positioner"].astype(int), columns(knots, "time", "alpha", "beta")
        refuse(set(owner) != set(range(self.n)) or (np.diff(owner) < 0).any(), "KNOTS: one has none, or out of order")
        self.knots = np.split(every, np.searchsorted(owner, np.arange(1, self.n)))
        later = all((np.diff(own[:, 0]) > 0).all() for own in self.knots)
        refuse(not (later and np.isfinite(every).all()), "KNOTS: times do not increase, or are no numbers")
        far = np.vstack([np.outer([0.0, 0.0, 1.0], self.place[:, 2]), np.abs(self.bar[:, :1].T)])  # of links' origins
        ends = [[far[s.link][i] + np.abs(s.points).max() + s.radius for s in self.arms[i]] for i in range(self.n)]
        most = max([np.abs(self.place).max(), *(np.abs(shape.points).max() for (shape,) in fixed)])
        self.base, self.slack = self.place[:, 0] + 1j * self.place[:, 1], FLOATS + 1e-12 * most  # what floats lose [mm]
        self.reach = np.array([max(own, default=0) for own in ends]) + self.error[: self.n] + self.margin + self.slack
        self.rows: dict[tuple, list] = {}
        names, stated = ["first", "second", "begin", "end", "axis"], tables.get("CERTIFICATE_AXES")
        for i, k, *row in [] if stated is None else stated[names].tolist():
            self.rows.setdefault((i, k if k >= 0 else self.n - 1 - k), []).append(row)
        nearer = tables["CERTIFICATE"][tables["CERTIFICATE"]["kind"] == b"opening"]
        said = nearer[["first", "second", "clearance", "time"]].tolist()
        self.opening = {(i, k if k >= 0 else self.n - 1 - k): (gap, time) for i, k, gap, time in said}

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Pairs of arms, of which one can move, that could come within the margin, however they turned."""
        for i in range(self.n):
            near = ~(np.abs(self.base[i + 1 :] - self.base[i]) > self.reach[i] + self.reach[i + 1 :])
            yield from ((i, i + 1 + int(k)) for k in np.flatnonzero(near & (self.online[i + 1 :] | self.online[i])))
        for j, (shape,) in enumerate(self.arms[self.n :], self.n):
            gaps = [away(self.base, shape.points[[*part]]) for part in shape.parts]
            near = ~(np.min(gaps, axis=0) > self.reach + shape.radius)
            seen = shape.points - self.base[:, None]
            near |= shape.hollow & ~(np.abs(np.angle(np.roll(seen, -1, axis=1) / seen).sum(axis=1)) < 1)
            yield from ((int(i), j) for i in np.flatnonzero(near & self.online))

    def joints(self, arm: int, t: float) -> list:
        """Alpha and beta [rad] at t, and their speeds [rad/s] from the last knot by then to the next, as balls."""
        own = self.knots[arm] if arm < self.n else np.zeros((1, 3))
        k = int(np.searchsorted(own[:, 0], t, "right"))
        if k in (0, len(own)):
            return [*map(arb, own[min(k, len(own) - 1), 1:].tolist()), arb(0), arb(0)]
        (t0, *here), (t1, *after) = (map(arb, own[row].tolist()) for row in (k - 1, k))
        speeds = [(b - a) / (t1 - t0) for a, b in zip(here, after, strict=True)]
        return [a + v * (arb(t) - t0) for a, v in zip(here, speeds, strict=True)] + speeds

    def links(self, arm: int, alpha: Any, beta: Any, va: Any, vb: Any) -> list[tuple]:
        """Origin, its speed, direction and turning rate of each link; of four-bar arms then J3 to J4, its change."""
        fixed, zero = (acb(0), acb(0), acb(1), arb(0)), acb(0)
        if arm >= self.n:
            return [fixed]
        x, y, length, alpha0, beta0 = map(arb, self.place[arm].tolist())
        spacing, rocker, _, _, lean = map(arb, self.bar[arm].tolist() or [0.0] * 5)
        base, crank = acb(x, y), unit(alpha + alpha0 + lean)
        links = [(base, *fixed[1:]), (base, zero, crank, va)]
        elbow, moving = base + length * crank, QUARTER * va * length * crank
        if not self.bar.size:
            return [*links, (elbow, moving, crank * unit(beta + beta0), va + vb)]
        pivot, third = base + spacing * unit(lean), -unit(lean - beta0 - beta)  # J2; the rocker turns the other way
        slide, change = pivot + rocker * third - elbow, -QUARTER * vb * rocker * third - moving
        probe, rate = slide / abs(slide), (slide.conjugate() * change).imag / abs(slide) ** 2
        return [*links, (elbow, moving, probe, rate), (pivot, zero, third, -vb), (slide, change)]

    def seen(self, arm: int, m: float, h: float) -> tuple[list, list]:
        """`links` at m, and all over m +- h, within which the arm has no knot."""
        alpha, beta, va, vb = self.joints(arm, m)
        now, span = self.links(arm, alpha, beta, va, vb), arb(0, h)
        return now, now if va == 0 and vb == 0 else self.links(arm, alpha + va * span, beta + vb * span, va, vb)

    def vertices(self, arm: int, m: float, h: float) -> list[list[tuple]]:
        """Of each shape each vertex: where it is at m [mm], and how fast it moves all over m +- h [mm/s]."""
        (now, over), found = self.seen(arm, m, h), []
        for shape in self.arms[arm]:
            (origin, _, turn, _), (_, speed, turns, rate) = now[shape.link], over[shape.link]
            found.append([(origin + turn * z, speed + QUARTER * rate * turns * z) for z in shape.exact])
        return found

    def meeting(self, i: int, j: int) -> Iterator[tuple[int, Shape, int, Shape]]:
        """Shapes of two arms of which either meets the other's category."""
        for (p, one), (q, other) in product(enumerate(self.arms[i]), enumerate(self.arms[j])):
            if any(a.meets is None or b.category in a.meets for a, b in ((one, other), (other, one))):
                yield p, one, q, other

    def parts(self, i: int, j: int) -> list[tuple]:
        """Convex parts of two arms that meet: shape and vertices of each, and the room for radii and errors [mm]."""
        found: list[tuple] = []
        for p, one, q, other in self.meeting(i, j):
            room = sum(map(arb, (one.radius, other.radius, float(self.error[i]), float(self.error[j]))))
            gaps = [0.0 if j < self.n else away(self.base[i : i + 1], other.points[[*b]])[0] for b in other.parts]
            near = [not gap > self.reach[i] + other.radius for gap in gaps]
            found += [(p, a, q, b, room) for a in one.parts for b in compress(other.parts, near)]
        return found

    def judge(self, i: int, j: int) -> str | None:
        """What is not shown of a pair; None if all is."""
        todo, ends = self.parts(i, j), [self.knots[arm][:, 0].tolist() for arm in (i, j) if arm < self.n]
        begin, end = min(own[0] for own in ends), max(own[-1] for own in ends)
        rows, (floor, until) = self.rows.get((i, j), []), self.opening.get((i, j), (self.margin, -math.inf))
        cuts = sorted(t for t in {begin, end, until, *chain(*ends, *(row[:2] for row in rows))} if begin <= t <= end)
        for a, b in [*pairwise(cuts)] or [(begin, begin)]:
            axes = [unit(-arb(axis)) for first, last, axis in rows if first <= a and b <= last]
            level = arb(self.margin) if a >= until else arb(floor) - OPENING
            if todo and not everywhere(a, b, todo, partial(self.parted, i, j, axes, level)):
                return f"is not shown from {a:.6g} to {b:.6g} s, of which {len(axes)} rows speak"
        hollow = [four for four in self.meeting(i, j) if four[1].hollow or four[3].hollow]
        if hollow and not (floor >= OPENING or until == -math.inf):
            return "is undecided: outlines that are not convex may overlap at the start"
        one, other = ([[z for z, _ in s] for s in self.vertices(arm, begin, 0.0)] if hollow else [] for arm in (i, j))
        for p, first, q, second in hollow:  # the edges never touch, so whoever is outside at first stays so
            if (first.hollow and winds(one[p], other[q][0])) or (second.hollow and winds(other[q], one[p][0])):
                return "is not shown to begin outside of each other"
        return None

    def parted(self, i: int, j: int, axes: list, level: Any, m: float, h: float, todo: list) -> tuple[list, list]:
        """Of pairs of parts, those that no axis keeps apart all over m +- h, and those that none does at m."""
        arms, span, left, false = [self.vertices(arm, m, h) for arm in (i, j)], arb(0, h), todo, todo
        for axis in axes:
            at = [[[((z * axis).real, (v * axis).real) for z, v in shape] for shape in arm] for arm in arms]
            tip, tail = (one(chain(*arm), key=lambda f: float(f[0])) for one, arm in zip((max, min), at, strict=True))
            pace = ((tip[1] + tail[1]) / 2).mid()  # of a line between them: any is as good, this one gains most
            now = [[[f for f, _ in shape] for shape in arm] for arm in at]
            over = [[[f + (v - pace) * span for f, v in shape] for shape in arm] for arm in at]
            left = [pair for pair in left if not apart(over, level, *pair)]
            false = [pair for pair in false if not apart(now, level, *pair)]
        return left, false


def apart(at: list, level: Any, p: int, a: tuple, q: int, b: tuple, room: Any) -> bool:
    """Whether vertices `a` of the first arm's shape p are before vertices `b` of the other's q, by room and level."""
    gap = reduce(arb.min, (at[1][q][k] for k in b)) - reduce(arb.max, (at[0][p][k] for k in a))
    return bool(gap > room + level)
