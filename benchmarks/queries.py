"""Queries with exact answers: do two moving arms come nearer than they should? Who misses contacts, or invents some?

Motions are those of `tests/fuzz/planted.py`: slow, brief, with knots that both share, since 1970, past one that cannot
move. How near the two come is sampled, finer and finer. In half of the queries they have to keep 1e-6 to 0.3 mm more
than that, so that they touch at a known moment; in the other half they keep 5 um more than they have to (where `verify`
names a moment at which they do not, the query is left out). Beside `verify` is what is usual in the field: clearances
at steps in which no joint turns by more than 1 or 0.1 deg (Sayres2021), by shapely and, where it is installed, by coal.

--out writes the queries as JSON, one a line: the two `arms` as `tests/fuzz/stated.py` has them, the `kind` of motion,
the `room` that they have to keep [mm], and whether they `touch`.

Usage: python benchmarks/queries.py [--count N] [--out queries.jsonl]
"""

import argparse
import itertools
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from fuzz.planted import CLEAR, found, twos
from fuzz.stated import stated
from references import clearance_over_time, smallest_over_time

STEPS = (1.0, 0.1)  # [deg]
SAMPLED = {"shapely": clearance_over_time}
try:
    import coal_clearance
except ModuleNotFoundError as missing:
    print(f"no row of coal, which is not installed ({missing}): pip install coal", file=sys.stderr)
else:
    SAMPLED["coal"] = coal_clearance.clearance_over_time


def least(clearances, step: float, plane, motion, i, arm) -> float:
    """Smallest of the clearances at steps in which no joint turns by more than `step` [deg]."""
    knots = [motion.times[slice(*motion.offsets[k : k + 2])] for k in (i, arm) if k < plane.n]
    knots = np.unique(np.concatenate(knots))
    turned = np.abs(np.diff([motion.at(t)[[k for k in (i, arm) if k < plane.n]] for t in knots], axis=0))
    counts = np.ceil(turned.max(axis=(1, 2)) / np.radians(step)).astype(int) if len(knots) > 1 else []
    spans = zip(knots[:-1], knots[1:], counts, strict=True)
    parts = [np.linspace(a, b, max(1, count), endpoint=False) for a, b, count in spans]
    return float(clearances(plane, motion, i, arm, np.concatenate([*parts, knots[-1:]])).min())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1_000, help="queries")
    parser.add_argument("--out", type=Path, default=None, help="write them to this file")
    options = parser.parse_args()
    ways = list(itertools.product(SAMPLED, STEPS))
    names = ["verify", *(f"{who}, every {step:g} deg" for who, step in ways)]
    wrong = {name: [0, 0] for name in names}
    asked, lines, seed = [0, 0], [], 0
    while sum(asked) < options.count:
        plane, motion, made = twos(np.random.default_rng(seed), 20)
        seed += 1
        if plane.kinematics.has_avoidance:
            continue  # the queries are of arms of two links
        at_steps = {pair: [least(SAMPLED[who], step, plane, motion, *pair) for who, step in ways] for pair in made}
        nearest = {pair: min(smallest_over_time(plane, motion, *pair, 300)[0], *at_steps[pair]) for pair in made}
        for touch in (1, 0):
            room = {p: nearest[p] + (depth if touch else -CLEAR - 1e-6) for p, (_, _, depth) in made.items()}
            room = {pair: keep for pair, keep in room.items() if keep > 0.0}
            error = np.zeros(plane.n)
            error[[pair[0] for pair in room]] = list(room.values())
            told = found(plane, motion, error)[0]
            for pair, keep in room.items():
                contact = told.get((pair[0], plane.public(pair[1])))
                if contact and not touch:
                    gap = clearance_over_time(plane, motion, *pair, np.array([contact.time]))[0]
                    if gap < keep + CLEAR:
                        continue  # sampling missed how near they come
                asked[touch] += 1
                said = [contact is not None, *(gap < keep for gap in at_steps[pair])]
                for name, answer in zip(names, said, strict=True):
                    wrong[name][touch] += answer != touch
                if options.out is not None:
                    arms = [stated(plane, motion, arm) for arm in pair]
                    lines.append(json.dumps({"arms": arms, "kind": made[pair][0], "room": keep, "touch": bool(touch)}))
    print(f"{asked[1]} contacts, {asked[0]} that stay clear by 5 um")
    print(f"{'':24} {'contacts missed':>16} {'contacts invented':>18}")
    for name, (invented, missed) in wrong.items():
        print(f"{name:24} {missed:10} {missed / asked[1]:5.1%} {invented:12} {invented / asked[0]:5.1%}")
    if options.out is not None:
        options.out.write_text("".join(f"{line}\n" for line in lines))


if __name__ == "__main__":
    main()
