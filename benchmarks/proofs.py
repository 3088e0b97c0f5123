"""What it costs to carry a proof along and to replay it, and what gets past it: the figures of docs/proof.md.

547 robots go from field to field by `Direct`. Then plan files with anything in them changed are replayed (mutations),
and contacts that are planted are looked for by `verify` (as `make fuzz` does, counted). CPU times, kernels warm.

Usage: python benchmarks/proofs.py [--fields N] [--mutations N] [--losses N] [--planted N] [--clear N]
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.certificates import verify
from fiberplan.certificates.replay import Claims
from fiberplan.certificates.whole_replay import replay
from fiberplan.certificates.witnesses import witnesses
from fiberplan.io.plan_file import plan_bytes
from fiberplan.scenes.uniform import uniform_field
from measure import calibrated, timed

MARGIN = 1.0  # [mm]: a buffer of 2.0


def costs(fields: int) -> None:
    """Certificates of so many fields: rows, bytes, and the time to make, write and replay them."""
    plane = fp.FocalPlane.load("sayres2021")
    found = []
    for seed in range(fields):
        start, goal = (uniform_field(plane, which, MARGIN) for which in (seed, seed + 100))
        plan = fp.planners.Direct(seed=0).plan(fp.Problem(plane, start, goal, MARGIN))
        error = plan.problem.position_error
        prove, _, proof = timed(lambda plan=plan: verify(plane, plan.trajectory, MARGIN))
        assert proof.ok
        make, _, made = timed(lambda plan=plan, error=error: witnesses(plane, plan.trajectory, MARGIN, error))
        without, _, bare = timed(lambda plan=plan: plan_bytes(plan, certificate=False))
        whole, _, content = timed(lambda plan=plan: plan_bytes(plan))
        judge, _, answer = timed(lambda content=content: replay(Claims(content), jobs=1))
        assert answer.faults == (), answer.faults[:3]
        rng = np.random.default_rng(seed)
        amended = None
        while amended is None:
            i = int(rng.integers(plane.n))
            try:
                amended = fp.planners.amend(plan, i, plane.kinematics.random(plane, rng, np.array([i]))[0])
            except fp.ProblemError:
                continue
        new = plan_bytes(amended)
        after, _, again = timed(lambda new=new, old=content: replay(Claims(new), Claims(old), jobs=1))
        assert again.faults == (), again.faults[:3]
        size = (len(content) - len(bare)) / 1e6
        found.append((1e3 * prove, len(made.axis), size, 1e3 * make, whole - without, judge, again.judged, after))
    names = (
        "verify [ms]",
        "rows",
        "size [MB]",
        "making [ms]",
        "writing it [s]",
        "replay [s]",
        "pairs since",
        "since [s]",
    )
    for name, values in zip(names, np.array(found).T, strict=True):
        print(f"  {name:20} median {np.median(values):9.3f}   worst {values.max():9.3f}")
    with tempfile.TemporaryDirectory() as folder:
        for name, data in (("old", content), ("new", new)):
            (Path(folder) / f"{name}.fits").write_bytes(data)
        command = [sys.executable, "-m", "fiberplan", "replay", "new.fits", "--since", "old.fits"]
        done = subprocess.run(command, cwd=folder, capture_output=True)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = used.ru_utime + used.ru_stime
        print(f"  the command `replay new.fits --since old.fits`: exit code {done.returncode}, {spent:.1f} s of CPU")


def mutants(kind, count: int, what: str) -> None:
    """What becomes of so many mutations of certificates of arrays of a few robots."""
    from fuzz.made_false import one_mutation

    told: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(-(-count // 50)):
            rng = np.random.default_rng(seed)
            name = list(kind.bases)[seed % len(kind.bases)]
            for _ in range(50):
                answer, changed, _ = one_mutation(rng, kind, name, Path(folder))
                told[answer] += 1
                if answer == "false":
                    print(f"  false and accepted: {name}, seed {seed}, after mutations of {', '.join(changed)}")
    print(f"{sum(told.values())} mutations of {what}: {dict(told)}; false certificates accepted: {told['false']}")


def plants(count: int) -> None:
    """How many of so many planted contacts `verify` misses."""
    from fuzz.planted import contacts

    planted, missed, seed = 0, 0, 0
    while planted < count:
        there, lost = contacts(np.random.default_rng(seed), 150)
        if (planted + there) // 10_000 > planted // 10_000:
            print(f"  {planted + there}: {missed + len(lost)} missed", flush=True)
        planted, missed, seed = planted + there, missed + len(lost), seed + 1
    print(f"{planted} planted contacts: {missed} missed")


def alarms_over(count: int) -> None:
    """How many of so many motions that stay clear by more than 5 um `verify` calls unsafe, and of grazes it misses."""
    from fuzz.planted import alarms

    kept, false, lost, seed = 0, 0, 0, 0
    while kept < count:
        there, blamed, missed = alarms(np.random.default_rng(seed), 150)
        if (kept + there) // 1_000 > kept // 1_000:
            print(f"  {kept + there}: {false + len(blamed)} called unsafe, {lost + len(missed)} missed", flush=True)
        kept, false, lost, seed = kept + there, false + len(blamed), lost + len(missed), seed + 1
    print(f"{kept} motions clear by 5 um and more: {false} called unsafe; made to graze by 1e-6 mm: {lost} missed")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fields", type=int, default=5)
    parser.add_argument("--mutations", type=int, default=10_000)
    parser.add_argument("--losses", type=int, default=5_000)
    parser.add_argument("--planted", type=int, default=100_000)
    parser.add_argument("--clear", type=int, default=10_000)
    options = parser.parse_args()
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    if options.fields:
        print(f"547 robots, field to field, Direct, margin {MARGIN:g} mm, {options.fields} fields; CPU, one core")
        costs(options.fields)
        print(f"  10^8 segment distances: {calibrated(3):.2f} s")
    from fuzz.losses import LOSSES
    from fuzz.mutations import SAFETY

    mutants(SAFETY, options.mutations, "motions that are safe, 3 to 37 robots")
    mutants(LOSSES, options.losses, "goals that are out of reach, 1 to 3 robots")
    if options.planted:
        plants(options.planted)
    if options.clear:
        alarms_over(options.clear)


if __name__ == "__main__":
    main()
