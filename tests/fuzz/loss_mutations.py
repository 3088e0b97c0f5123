"""Ways to make a proof that a goal is out of reach false, in the tables of a plan file."""

import numpy as np

from fiberplan.io.certificate_tables import WIDTH
from fuzz.made_false import number, restate, set_margin

JOINTS = ("alpha", "beta")


def mutate(rng, tables):
    """Change something; returns what, in words."""
    there = all(len(tables.get(f"CERTIFICATE_{name}", ())) for name in ("BARRIERS", "TREES"))
    kinds = [*BOXES, *ASKED] if there else [*ASKED]
    kind = str(rng.choice(kinds))
    (BOXES | ASKED)[kind](rng, tables)
    return kind


def trees(tables) -> dict[int, str]:
    """The boxes of each barrier."""
    rows = tables["CERTIFICATE_TREES"]
    return {k: b"".join(rows["boxes"][rows["barrier"] == k].tolist()).decode() for k in np.unique(rows["barrier"])}


def put(tables, texts: dict[int, str]) -> None:
    """Other boxes."""
    rows = [(k, text[at : at + WIDTH].encode()) for k, text in texts.items() for at in range(0, len(text), WIDTH)]
    tables["CERTIFICATE_TREES"] = np.array(rows, [("barrier", ">i8"), ("boxes", f"S{WIDTH}")])


def part(tree: str, at: int) -> int:
    """Where the box that begins at `at` ends."""
    open_ = 1
    while open_ and at < len(tree):
        open_ += 1 if tree[at].isdigit() else -1
        at += 1
    return at


def marks(rng, tables):
    """A box is called something else."""
    texts = trees(tables)
    k = rng.choice(list(texts))
    for _ in range(int(rng.choice([1, 1, 3, 20]))):
        at = int(rng.integers(len(texts[k])))
        if not texts[k][at].isdigit():
            texts[k] = texts[k][:at] + str(rng.choice(list("ibo"))) + texts[k][at + 1 :]
    put(tables, texts)


def cuts(rng, tables):
    """A box is halved in another joint, or its halves are exchanged."""
    texts = trees(tables)
    k = rng.choice(list(texts))
    at = rng.choice([x for x, mark in enumerate(texts[k]) if mark.isdigit()] or [0])
    tree, middle = texts[k], part(texts[k], at + 1)
    end = part(tree, middle)
    if rng.random() < 0.5:
        texts[k] = tree[:at] + str(rng.integers(6)) + tree[at + 1 :]
    else:
        texts[k] = tree[: at + 1] + tree[middle:end] + tree[at + 1 : middle] + tree[end:]
    put(tables, texts)


def dropped(rng, tables):
    """Boxes are told as one, left out, told twice, cut off, or those of another proof; or rows change places."""
    texts = trees(tables)
    k, kind = rng.choice(list(texts)), rng.integers(6)
    tree = texts[k]
    at = int(rng.integers(len(tree)))
    end = part(tree, at)
    if kind < 2:
        texts[k] = tree[:at] + str(rng.choice(list("ibo"))) + tree[end:]
    elif kind == 2:
        texts[k] = tree[:at] + (tree[end:] if rng.random() < 0.5 else 2 * tree[at:end] + tree[end:])
    elif kind == 3:
        texts[k] = tree[:at]
    elif kind == 4:
        texts[k] = texts[rng.choice(list(texts))]
    put(tables, texts)
    if kind == 5:
        tables["CERTIFICATE_TREES"] = rng.permutation(tables["CERTIFICATE_TREES"])


def members(rng, tables):
    """Other positioners, or lost, or turning, or goals of a proof; a row less, or one twice."""
    rows, n = tables["CERTIFICATE_BARRIERS"], len(tables["PROBLEM"])
    k, kind = int(rng.integers(len(rows))), rng.integers(6)
    if kind < 3:
        rows[("positioner", "lost", "barrier")[kind]][k] = rng.integers(-1, n + 1)
    elif kind == 3:
        rows["turns"][k] = b"F" if rows["turns"][k] == b"T" else b"T"
    elif kind == 4:
        for joint in JOINTS if rng.random() < 0.5 else JOINTS[:1]:
            rows[f"goal_{joint}"][k] = rng.choice([np.nan, number(rng, rows[f"goal_{joint}"][k])])
    else:
        tables["CERTIFICATE_BARRIERS"] = np.delete(rows, k) if rng.random() < 0.5 else np.append(rows, rows[k : k + 1])


def margin(rng, tables):
    """Another margin, mostly a smaller one."""
    less = 10.0 ** rng.uniform(-7, 0)

    def change(said):
        now = said["problem"]["margin"]
        set_margin(said, float(number(rng, now) if rng.random() < 0.3 else max(now - less, 0.0)))

    restate(tables, change)


def errors(rng, tables):
    """A position error."""
    error = tables["PROBLEM"]["position_error"]
    error[int(rng.integers(len(error)))] = number(rng, 0.0)


def start(rng, tables):
    """One starts elsewhere, and has all its motion so much farther on."""
    problem, knots = tables["PROBLEM"], tables["KNOTS"]
    i, joint = int(rng.integers(len(problem))), str(rng.choice(JOINTS))
    change = number(rng, problem[f"start_{joint}"][i]) - problem[f"start_{joint}"][i]
    problem[f"start_{joint}"][i] += change
    own = np.flatnonzero(knots["positioner"] == i)
    knots[joint][own if rng.random() < 0.7 else own[:1]] += change


def goals(rng, tables):
    """One is asked to be elsewhere, or nothing is kept of it, and the proof may say so, too."""
    problem, names = tables["PROBLEM"], tables["PROBLEM"].dtype.names
    i, joint = int(rng.integers(len(problem))), str(rng.choice(JOINTS))
    column, kind = f"goal_{joint}", rng.random()
    before = float(np.ravel(problem[column][i])[0])
    if kind < 0.15:
        problem["goal_alpha"][i] = problem["goal_beta"][i] = np.nan
        return
    after = float(number(rng, before))
    if kind < 0.35 and f"alternatives_{joint}" in names:
        other = problem[f"alternatives_{joint}"]
        other[i] = number(rng, float(np.ravel(other[i])[0]))
        return
    problem[column][i] = problem[f"requested_{joint}"][i] = after
    rows = tables.get("CERTIFICATE_BARRIERS")
    if rows is not None and kind < 0.9:
        rows[column][(rows["positioner"] == i) & (rows[column] == before)] = after


def arms(rng, tables):
    """Ranges, speeds, places, lengths or zeros of an arm."""
    table = tables["POSITIONERS"]
    names = [name for name in table.dtype.names if table.dtype[name].kind == "f"]
    wide = [name for name in names if name.startswith(("lower", "upper", "max_speed"))]
    name, i = str(rng.choice(wide if rng.random() < 0.6 else names)), int(rng.integers(len(table)))
    table[name][i] = number(rng, float(table[name][i]))


def bodies(rng, tables):
    """A point or the radius of the bodies, or what they meet."""
    table = tables["BODIES"]
    k, name = int(rng.integers(len(table))), str(rng.choice(["x", "y", "radius", "meets"]))
    if name == "meets":
        table["meets"] = rng.choice([b"[]", b"null", b'"arm"'])
    else:
        table[name][k if name != "radius" else slice(None)] = number(rng, float(table[name][k]))


def obstacles(rng, tables):
    """An obstacle less, or elsewhere, or of another size."""
    table = tables["OBSTACLES"]
    if not len(table):
        return
    k, kind = int(rng.integers(len(table))), rng.integers(3)
    if kind == 0:
        table = table[table["obstacle"] != table["obstacle"][k]].copy()
        table["obstacle"] = np.unique(table["obstacle"], return_inverse=True)[1]
        tables["OBSTACLES"] = table
    else:
        name = str(rng.choice(["x", "y"])) if kind == 1 else "radius"
        table[name][k] = number(rng, float(table[name][k]))


def online(rng, tables):
    """One more that can move, or cannot."""
    table = tables["POSITIONERS"]
    i = int(rng.integers(len(table)))
    table["online"][i] = b"F" if table["online"][i] == b"T" else b"T"


def outcomes(rng, tables):
    """Another outcome; of who is said to be lost the goal may be given up."""
    problem = tables["PROBLEM"]
    i, name = int(rng.integers(len(problem))), str(rng.choice(["INFEASIBLE", "ARRIVED", "DROPPED", "DEADLOCKED"]))
    for table in ("POSITIONERS", "PROBLEM"):
        tables[table]["outcome"][i] = name.encode()
    if name == "INFEASIBLE" and rng.random() < 0.3:
        problem["goal_alpha"][i] = problem["goal_beta"][i] = np.nan


def time(rng, tables):
    """Another time that there is."""
    after = float(rng.choice([rng.uniform(0.0, 20.0), number(rng, 1.0)]))
    restate(tables, lambda said: said["parameters"].update(max_time=after))


BOXES = {"marks": marks, "cuts": cuts, "dropped boxes": dropped, "members": members}
ASKED = {f.__name__: f for f in (margin, errors, start, goals, arms, bodies, obstacles, online, outcomes, time)}
