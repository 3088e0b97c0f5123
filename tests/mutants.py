"""Does a test notice when a kernel or a proof is wrong? `make mutants` makes it wrong in one place at a time and asks.

Each mutant is one change of one file of `kernels/` or `certificates/`: a comparison or a sign turned round, a constant
doubled, min for max, `and` for `or`, a `not` dropped. The tests nearest to the file run on a copy with the compiler
off. What came of each is kept in ``.mutants.json``, so that a run goes on where the last one stopped.
"""

import argparse
import ast
import collections
import copy
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / ".mutants.json"
PATIENCE = 20.0  # [s] a mutant whose tests take longer is slow: it may loop for ever, or survive
TESTS = {  # the fastest first: most mutants die in the first
    "segments": "segments",
    "clearance": "clearance sweep",
    "arms": "clearance motion_bounds four_bar",
    "four_bar": "four_bar motion_bounds",
    "even_motion": "verify motion_bounds",
    "sweep": "sweep",
    "neighbours": "neighbours",
    "bisection": "verify",
    "path": "verify",
    "safety": "verify",
    "unreachable": "unreachable",
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
        old, new = text[begin:end].decode(), ast.unparse(wrong)
        if not isinstance(node, ast.Constant | ast.Name | ast.Attribute | ast.AugAssign):
            new = f"({new})"
        found[f"{path.parent.name}/{path.name}:{node.lineno}:{node.col_offset}: {old} -> {new}"] = (
            text[:begin] + new.encode() + text[end:]
        ).decode()
    return found


def outcome(copied: Path, path: Path, source: str, tests: str) -> str:
    """Killed, survived or slow, of one wrong source in a copy of the project."""
    target = copied / path.relative_to(ROOT)
    good = target.read_text()
    target.write_text(source)
    files = [f"tests/test_{name}.py" for name in tests.split() if (copied / f"tests/test_{name}.py").exists()]
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-n",
        "0",
        "-p",
        "no:cacheprovider",
        "-m",
        "not slow",
        *files,
    ]
    variables = {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(copied / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(command, cwd=copied, env=os.environ | variables, capture_output=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return "slow"
    finally:
        target.write_text(good)
    if done.returncode > 1:
        return "killed"  # it cannot even be imported
    return "survived" if done.returncode == 0 else "killed"


def main() -> None:
    """Try as many more mutants as asked for, drawn at random, and say what became of all so far."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sample", type=int, default=300, help="how many in all, of those that there are")
    parser.add_argument("--only", default="", help="part of the name of a file")
    wanted = parser.parse_args()
    rooms = [ROOT / "src/fiberplan" / room for room in ("kernels", "certificates")]
    paths = [path for room in rooms for path in sorted(room.glob("*.py")) if path.stem in TESTS]
    every = [(name, path, source) for path in paths for name, source in mutants(path).items() if wanted.only in name]
    random.Random(0).shuffle(every)
    results: dict[str, str] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        copied = Path(folder)
        for room in ("src", "tests", "benchmarks"):
            shutil.copytree(ROOT / room, copied / room, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(ROOT / "pyproject.toml", copied)
        for name, path, source in every[: wanted.sample]:
            if name not in results:
                results[name] = outcome(copied, path, source, TESTS[path.stem])
                RESULTS.write_text(json.dumps(results, indent=1, sort_keys=True))
                print(f"{results[name]:8} {name}", flush=True)
    print(dict(collections.Counter(results.values())), "of", len(every))


if __name__ == "__main__":
    main()
