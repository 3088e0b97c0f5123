"""Exports of our own with faults planted: every contact that dense sampling sees is found, and no other."""

import itertools
import json
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.focal_plane.drift import motion_bounds
from fiberplan.hardware import sdss
from fiberplan.hardware.audit import audit
from fiberplan.scenes.uniform import uniform_field
from problems import hexagon
from references import smallest_over_time
from wrong_files import as_table, faulty, told

FAULTS = 50  #: planted into one export, one a file
MARGIN, LEFT = 0.8, 0.75  # [mm] that is planned, and audited
SEEN = 1e-4  # [mm] sampling is this coarse,
ROUNDED = 0.02  # and controllers cut off up to this


def audits(rng: np.random.Generator, folder: Path) -> None:
    """As trajectories of SDSS and as tables: a knot moved, two robots exchanged, a robot late."""
    plane = hexagon(1, max_speed=np.radians(11.7))
    start, goal = (uniform_field(plane, int(rng.integers(10**6)), MARGIN) for _ in range(2))
    plan = fp.planners.GreedyFold().plan(fp.Problem(plane, start, goal, MARGIN))
    sent = sdss.trajectory(plan)
    for _ in range(FAULTS):
        made, names = faulty(sent, rng)
        if rng.random() < 0.5:
            file, content = folder / "f.json", json.dumps({"trajectory": made})
        else:
            file, content = folder / "f.csv", as_table(made)
        file.write_text(content)
        read = audit(plane, file, margin=LEFT)
        found = {c.pair: c for c in read.certificate.contacts}
        off = motion_bounds(plane, read.executed.joint_error)  # much, where a file asks for speeds that no motor has
        motion, changed = told(plane, made), {plane.names[name] for name in names}
        assert all(set(pair) & changed for pair in found), f"{found} touch, and only {names} move otherwise"
        for pair in itertools.combinations(range(plane.n), 2):
            if set(pair) & changed:
                seen, when = smallest_over_time(plane, motion, *pair, 150)
                if pair in found and seen >= LEFT:  # a short one, perhaps
                    seen, when = smallest_over_time(plane, motion, *pair, 2000)
                assert seen >= LEFT - SEEN or pair in found, f"{pair} come within {seen:.4f} mm at {when:.3f} s"
                if pair in found:
                    least = LEFT + ROUNDED + off[list(pair)].sum()
                    assert seen < least, f"{pair} are said to touch and are {seen:.4f} mm apart"
                    assert found[pair].time <= when + 1e-3 or seen >= LEFT - SEEN
