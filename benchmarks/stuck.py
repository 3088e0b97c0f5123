"""Positioners that are stuck in dense scenes: is there a path, or a proof that there is none?

19 arms of SDSS-V's nominal size (`hexagonal(2, 22.4)`) stand as a random field puts them. The middle one, two or three
can move, from where they stand to where another such field has them; all others never do. A scene counts where the
planners' search for a few (RRT-Connect of 500 nodes each way) gives up. Then, within 10 s of CPU, there is to be a
path that `verify` certifies at the margin, or a proof that there is none at the margin less 2e-6 mm, of which `replay`
allows for 1e-6: first of each alone, then jointly, with longer and longer searches of both kinds. CPU, one core.

Usage: python benchmarks/stuck.py [--robots 1 2 3] [--scenes N] [--margin MM]
"""

import argparse
import time
from collections import Counter

import numpy as np

import fiberplan as fp
from fiberplan.certificates.unreachable import decided
from fiberplan.focal_plane.neighbours import Neighbourhood
from fiberplan.planners.shared.rrt_connect import joint_path
from fiberplan.scenes.uniform import uniform_field
from fiberplan.tolerances import NEAR

MOVING = {1: [9], 2: [9, 10], 3: [9, 10, 5]}  #: neighbours of each other in the middle of 19
LONG = ((60_000, 5_000), (400_000, 50_000), (1_500_000, 100_000))  #: boxes and nodes, search after search
SECONDS = 10.0  # of CPU for one scene


def scenes(count: int, margin: float):
    """(seed, plane, start, goal) of random fields in which the moving may begin and end."""
    whole = fp.FocalPlane.hexagonal(2, 22.4)
    moving, seed = MOVING[count], -1
    while True:
        seed += 1
        start, other = (uniform_field(whole, 2 * seed + k, margin) for k in (0, 1))
        goal = np.array(start)
        goal[moving] = other[moving]
        plane = whole.replace(online=np.isin(np.arange(whole.n), moving))
        if np.nanmin(plane.clearance(goal)) >= margin + 2e-3:
            yield seed, plane, np.array(start), goal


def answer(plane: fp.FocalPlane, who: list[int], start: np.ndarray, goal: np.ndarray, margin: float) -> str:
    """How a scene is decided within the time; "undecided" if it is not."""
    begun, near = time.process_time(), Neighbourhood.of(plane, margin + NEAR)
    for i in who:
        if len(who) > 1 and decided(plane, [i], {i: goal[i]}, start, margin)[1] is not None:
            return "proof of one"
        for j in who:
            if j != i and decided(plane, [j], {i: goal[i]}, start, margin)[1] is not None:
                return "proof of one"
    if len(who) > 2:
        for pair in ([a, b] for a in who for b in who if a < b):
            if decided(plane, pair, {i: goal[i] for i in pair}, start, margin)[1] is not None:
                return "proof of two"
    for boxes, nodes in LONG:
        path, proof = decided(plane, who, {i: goal[i] for i in who}, start, margin, boxes)
        if proof is not None:
            return f"proof of {('one', 'two', 'three')[len(who) - 1]}"
        if path is not None:
            certify(plane, who, start, path.reshape(len(path), -1, 2), margin)
            return "path by boxes"
        if time.process_time() - begun > SECONDS:
            break
        way, _ = joint_path(plane, near, np.array(who), start, goal[who], margin, 1, nodes)
        if way is not None:
            certify(plane, who, start, way[1], margin)
            return "path by trees"
        if time.process_time() - begun > SECONDS:
            break
    return "undecided"


def certify(plane: fp.FocalPlane, who: list[int], start: np.ndarray, path: np.ndarray, margin: float) -> None:
    """The path (m, k, 2) is safe, or this fails."""
    speed = plane.max_speed[who] * (1.0 - 1e-9)
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path, axis=0) / speed).max(axis=(1, 2)) + 1e-3)])
    angles = np.repeat(np.asarray(start)[None], len(path), axis=0)
    angles[:, who] = path
    proof = fp.verify(plane, fp.Trajectory.from_samples(times, angles), margin - 2e-6)
    assert proof.ok, proof


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, nargs="+", default=[1, 2, 3], choices=MOVING)
    parser.add_argument("--scenes", type=int, default=100, help="stuck ones of each kind")
    parser.add_argument("--margin", type=float, default=1.0, help="(mm)")
    options = parser.parse_args()
    for count in options.robots:
        who, told, spent, undecided = MOVING[count], Counter[str](), list[float](), list[int]()
        for seed, plane, start, goal in scenes(count, options.margin):
            near = Neighbourhood.of(plane, options.margin + NEAR)
            if joint_path(plane, near, np.array(who), start, goal[who], options.margin, 0)[0] is not None:
                continue
            if not spent:
                answer(plane, who, start, goal, options.margin)  # kernels are compiled
            begun = time.process_time()
            how = answer(plane, who, start, goal, options.margin)
            spent.append(time.process_time() - begun)
            late = spent[-1] > SECONDS
            told["undecided" if late else how] += 1
            undecided += [seed] if late or how == "undecided" else []
            if len(spent) == options.scenes:
                break
            if len(spent) % 100 == 0 or count == 3:
                print(f"  {count} robots, {len(spent)} stuck of {seed + 1} fields: {dict(told)}", flush=True)
        good = 100.0 * (1.0 - len(undecided) / len(spent))
        print(f"{count} robots, margin {options.margin:g} mm: {len(spent)} stuck of {seed + 1}, {good:.2f} % decided")
        print(f"  {dict(told)}; undecided: {undecided}")
        quarters = np.quantile(spent, [0.5, 0.9, 1.0])
        print("  CPU [s] median {:.3f}, of ten nine {:.3f}, worst {:.2f}".format(*quarters), flush=True)


if __name__ == "__main__":
    main()
