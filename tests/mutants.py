"""Does a test notice when a kernel or a proof is wrong? `make mutants` makes it wrong in one place at a time and asks.

Each mutant is one change of one file of `kernels/` or `certificates/`: a comparison or a sign turned round, a constant
doubled, min for max, `and` for `or`, a `not` dropped. The tests nearest to the file run on a copy with the compiler
off, each mutant in a fork of a process that has everything but the project loaded. What came of each is kept in
``.mutants.json``, so that a run goes on where the last one stopped; mutants of a file that has changed since are tried
anew. ``design/mutants.md`` says what came of it.
"""

import argparse
import ast
import compileall
import copy
import hashlib
import importlib
import json
import multiprocessing
import os
import py_compile
import resource
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / ".mutants.json"
PATIENCE = 20  # [s] of processor: tests that take longer on a mutant found that it does not end, or too much to do
WALL = 6 * PATIENCE  # [s], for one that sleeps
LOADED = "numpy numba scipy.ndimage scipy.optimize scipy.spatial shapely hypothesis pytest astropy.table pydantic yaml"
TESTS = {  # the nearest first: most mutants die there
    "segments": "segment_oracles clearance_oracles",
    "arms": "arm_oracles clearance_oracles motion_oracles four_bar_oracles",
    "clearance": "clearance_oracles",
    "convex": "clearance_oracles",
    "depth": "depth_oracles",
    "slopes": "depth_oracles",
    "four_bar": "four_bar_oracles",
    "even_motion": "motion_oracles",
    "sweep": "motion_oracles",
    "neighbours": "neighbour_oracles",
    "randoms": "neighbour_oracles",
    "path": "path_oracles proof_oracles",
    "bisection": "proof_oracles",
    "opening": "opening_oracles",
    "unreachable": "unreachable_oracles barrier_oracles",
    "box_bounds": "box_bounds_oracles unreachable_oracles",
    "subdivision": "unreachable_oracles barrier_oracles",
    "box_search": "unreachable_oracles barrier_oracles",
    "lost": "barrier_oracles",
    "safety": "safety_oracles",
    "clocks": "clock_oracles",
    "tolerated": "tolerated_oracles",
    "guesses": "tolerated_oracles",
    "touching": "touching_oracles",
    "over_time": "touching_oracles",
    "violations": "safety_oracles motor_limits",
    "any_speed": "boxes_oracles any_speed",
    "boxes": "boxes_oracles any_speed",
    "keeping": "any_speed",
    "witnesses": "witness_oracles witnesses",
    "replay": "replay_claims replay",
    "replay_geometry": "replay",
    "replay_outcomes": "replay_claims replay_limits replay",
    "whole_replay": "replay",
    "replay_infeasible": "replay_limits replay_infeasible",
    "replay_boxes": "replay_limits replay_infeasible",
    "replay_contact": "replay_contact replay_contact_boxes",
}
COMPARISONS = {
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq
}  # fmt: skip
OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
OTHERS = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "cos": "sin", "sin": "cos"}


def mutated(node: ast.AST) -> ast.AST | None:
    """The same node, wrong; None if this kind is left alone."""
    node = copy.deepcopy(node)
    if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS:
        node.ops[0] = COMPARISONS[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp | ast.AugAssign) and type(node.op) in OPERATORS:
        node.op = OPERATORS[type(node.op)]()
    elif isinstance(node, ast.BoolOp):
        node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        return node.operand
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        node.value = 2 * node.value if node.value else 1
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        node.value = not node.value
    elif isinstance(node, ast.Name) and node.id in OTHERS:
        node.id = OTHERS[node.id]
    elif isinstance(node, ast.Attribute) and node.attr in OTHERS:
        node.attr = OTHERS[node.attr]
    else:
        return None
    return node


def mutants(path: Path) -> dict[str, str]:
    """Whole wrong sources of a file, by where they are wrong and how."""
    source = path.read_text()
    lines = source.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line.encode()))
    text = source.encode()
    found = {}
    for node in ast.walk(ast.parse(source)):
        wrong = mutated(node)
        if wrong is None or not hasattr(node, "lineno"):
            continue
        begin = starts[node.lineno - 1] + node.col_offset
        end = starts[node.end_lineno - 1] + node.end_col_offset
        old, new = " ".join(text[begin:end].decode().split()), ast.unparse(wrong)
        if not isinstance(node, ast.Constant | ast.Name | ast.Attribute | ast.AugAssign):
            new = f"({new})"
        found[f"{path.parent.name}/{path.name}:{node.lineno}:{node.col_offset}: {old} -> {new}"] = (
            text[:begin] + new.encode() + text[end:]
        ).decode()
    return found


def copied_project() -> Path:
    """A copy of what tests need, its modules compiled so that one with another source is never taken for another."""
    folder = Path(tempfile.mkdtemp(prefix="mutants-"))
    for room in ("src", "tests", "benchmarks"):
        shutil.copytree(ROOT / room, folder / room, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    mode = py_compile.PycInvalidationMode.CHECKED_HASH
    compileall.compile_dir(folder / "src", quiet=2, invalidation_mode=mode)
    return folder


def tests_pass(folder: Path, tests: list[str]) -> int:
    """Exit status of pytest in a fork of this process, negative if a signal ended it."""
    child = os.fork()
    if child == 0:
        status = 70
        try:
            os.setpgrp()  # to be ended as one, but as nice as the rest
            resource.setrlimit(resource.RLIMIT_CPU, (PATIENCE, PATIENCE + 1))
            signal.signal(signal.SIGXCPU, signal.SIG_DFL)
            null = os.open(os.devnull, os.O_RDWR)
            for stream in (0, 1, 2):
                os.dup2(null, stream)
            os.chdir(folder)
            sys.path[:0] = [str(folder / "src"), str(folder / "tests")]
            import pytest

            options = ["-q", "-x", "--tb=no", "--assert=plain", "-p", "no:cacheprovider", "-p", "no:xdist"]
            status = int(
                pytest.main([*options, "-m", "not slow and not large", *(f"tests/test_{name}.py" for name in tests)])
            )
        finally:
            os._exit(status)
    end = time.monotonic() + WALL
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.02)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return -signal.SIGKILL


def outcome(task: tuple[str, str, str]) -> tuple[str, str]:
    """(name, killed, survived or timeout) of one mutant."""
    name, where, source = task
    target = _folder / where
    good = target.read_text()
    target.write_text(source)
    try:
        status = tests_pass(_folder, TESTS[target.stem].split())
    finally:
        target.write_text(good)
    if status < 0:
        return name, "timeout"
    return name, "survived" if status == 0 else "killed"


def begin() -> None:
    """Load what all mutants share, and make the copy that this process breaks."""
    global _folder
    for module in LOADED.split():
        importlib.import_module(module)
    _folder = copied_project()


def known_results(paths: list[Path]) -> tuple[dict[str, str], dict[str, str]]:
    """(digest of each file, outcomes of earlier runs of files that are still the same)."""
    digests = {f"{p.parent.name}/{p.name}": hashlib.sha256(p.read_bytes()).hexdigest()[:16] for p in paths}
    kept = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    same = {file for file, digest in digests.items() if kept.get("files", {}).get(file) == digest}
    return digests, {n: o for n, o in kept.get("outcomes", {}).items() if n.partition(":")[0] in same}


def table(outcomes: dict[str, str]) -> str:
    """What came of the mutants of each file, and of all, as ``design/mutants.md`` has it."""
    rows = ["| File | tried | killed | timed out | survived |", "|---|---|---|---|---|"]
    for file in [*sorted({name.partition(":")[0] for name in outcomes}), ""]:
        came = [outcome for name, outcome in outcomes.items() if name.startswith(file)]
        shown = [len(came), *(came.count(outcome) for outcome in ("killed", "timeout", "survived"))]
        rows.append(f"| {f'`{Path(file).stem}`' if file else 'all'} | {' | '.join(str(n or '') for n in shown)} |")
    return "\n".join(rows)


def main() -> None:
    """Try as many mutants as asked for, in an order that is fixed but as good as random, and say what became of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sample", type=int, default=300, help="how many in all, of those that there are")
    parser.add_argument("--only", default="", help="part of the name of a file")
    parser.add_argument("--again", action="store_true", help="try those anew that were not killed")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    wanted = parser.parse_args()
    os.environ |= {"NUMBA_DISABLE_JIT": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    sys.dont_write_bytecode = True
    rooms = [ROOT / "src/fiberplan" / room for room in ("kernels", "certificates")]
    paths = [path for room in rooms for path in sorted(room.glob("*.py")) if path.stem in TESTS]
    every = [
        (name, str(path.relative_to(ROOT)), source)
        for path in paths
        for name, source in mutants(path).items()
        if wanted.only in name
    ]
    every.sort(key=lambda task: hashlib.sha256(task[0].encode()).digest())  # a file that changes moves its own only
    digests, results = known_results(paths)
    if wanted.again:
        tried = [task for task in every if results.get(task[0], "killed") != "killed"]
    else:
        tried = [task for task in every[: wanted.sample] if task[0] not in results]
    with multiprocessing.get_context("fork").Pool(wanted.jobs, begin) as pool:
        right = {TESTS[Path(t[1]).stem]: (f"as it is: {t[1]}", t[1], (ROOT / t[1]).read_text()) for t in tried}
        for name, came in pool.imap_unordered(outcome, right.values()):
            if came != "survived":
                sys.exit(f"{name}: {came}; a mutant says nothing while the tests fail on the project itself")
        for name, came in pool.imap_unordered(outcome, tried):
            results[name] = came
            RESULTS.write_text(json.dumps({"files": digests, "outcomes": results}, indent=1, sort_keys=True))
            print(f"{came:8} {name}", flush=True)
    told = {name: results[name] for name, _, _ in every[: wanted.sample] if name in results}
    print(table(told), f"{len(told)} of {len(every)} mutants", sep="\n")


if __name__ == "__main__":
    main()
