"""Plan files with anything in them changed, their digest made right again: none may pass its replay that is not true.

What the replay accepts is read as a plan, and `fiberplan.verify`, which knows nothing of certificates, and dense
sampling by shapely decide whether it is true all the same. What is changed is for `mutations` (of motions said to be
safe) and `losses` (of goals said to be out of reach).
"""

import functools
import io
import json
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from astropy.io import fits

from fiberplan.certificates.replay import BadFileError, Claims
from fiberplan.certificates.replay_outcomes import faults
from fiberplan.certificates.whole_replay import _changed, replay
from fiberplan.errors import FiberplanError
from fiberplan.io.sealed_tables import PLAN, seal
from fiberplan.plan import Plan
from references import smallest_over_time

SEEN = 1e-6  # [mm] what sampling sees below the margin is a contact


class Kind(NamedTuple):
    """What is changed, and in which files."""

    bases: dict[str, Callable[[], bytes]]  #: the content of plan files whose every claim holds
    mutate: Callable  #: changes something in tables; says what
    is_true: Callable  #: (plan, claims): whether what else such a file claims is true, of a plan that is safe


@functools.cache
def base(made: Callable[[], bytes]):
    """(tables with their formats and units, claims) of a file whose every claim holds."""
    content = made()
    with fits.open(io.BytesIO(content), character_as_bytes=True) as hdul:
        columns = {hdu.name: [(column.name, column.format, column.unit) for column in hdu.columns] for hdu in hdul[1:]}
    claims = Claims(content)
    assert replay(claims, jobs=1).faults == ()
    return columns, claims


def sealed(columns, tables, version=PLAN.version):
    """The file that these tables make, its digest right."""
    made = []
    for name, of in columns.items():
        data = {key: tables[name][key] == b"T" if form == "L" else tables[name][key] for key, form, _ in of}
        formed = [fits.Column(key, form, unit, array=data[key]) for key, form, unit in of]
        made.append(fits.BinTableHDU.from_columns(formed, name=name))
    return seal(PLAN._replace(version=version), made)


def number(rng, value):
    """Another number: near, elsewhere, or none."""
    kind = rng.integers(8)
    if kind < 4:
        return value + rng.normal() * 10.0 ** rng.uniform(-7, 0)
    return (value * rng.uniform(-1, 2), rng.uniform(-7, 7), 0.0, rng.choice([np.nan, np.inf, -np.inf]))[kind - 4]


def restate(tables, change: Callable[[dict], None]) -> None:
    """Change what is said in words and numbers beside the tables."""
    said = json.loads(tables["PARAMETERS"]["json"][0])
    change(said)
    text = json.dumps(said).encode()
    tables["PARAMETERS"] = np.array([(text,)], [("json", f"S{len(text)}")])


def set_margin(said: dict, margin: float, both: bool = True) -> None:
    """Another margin of the problem, and of the certificate."""
    said["problem"]["margin"] = margin
    if both:
        said["certificate"]["margin"] = margin


def accepted(tables, before):
    """Whether the replay of these tables, of which much is as `before`, finds nothing."""
    claims = object.__new__(Claims)
    try:
        claims._take(tables)
        pairs = list(claims.pairs())
        todo = set(_changed(claims, before, pairs))
        rows = {pair for pair in {*claims.rows, *before.rows} if claims.rows.get(pair) != before.rows.get(pair)}
        todo |= rows & set(pairs)
        return not any(faults(claims)) and all(claims.judge(*pair) is None for pair in sorted(todo))
    except (BadFileError, LookupError, TypeError, AttributeError, OSError, ValueError, RecursionError):
        return False  # as `Claims` refuses it


def is_safe(plan):
    """Whether a plan is safe and arrives as it says, by `verify` and sampling; None if it cannot be judged."""
    try:
        found = plan.faults()
    except FiberplanError:
        return None
    if not found:
        return True
    problem, plane = plan.problem, plan.problem.plane
    proof = plan.certificate
    if found != [str(proof)] or proof.zones or any("changes its speed" not in v for v in proof.violations):
        return False
    for contact in (*proof.contacts, *proof.undecided):
        i, arm = contact.pair[0], plane.arm(contact.pair[1])
        error = problem.position_error[[k for k in (i, arm) if k < plane.n]].sum()
        if smallest_over_time(plane, plan.trajectory, i, arm, 500)[0] - error < problem.margin - SEEN:
            return False
    return True


def one_mutation(rng, kind: Kind, name, folder):
    """("refused", "true", "false" or "unreadable", what was changed, the tables) of one mutation of a base."""
    columns, before = base(kind.bases[name])
    tables = {key: table.copy() for key, table in before.tables.items()}
    what = [kind.mutate(rng, tables) for _ in range(int(rng.choice([1, 1, 1, 2, 3])))]
    with np.errstate(all="ignore"):
        if not accepted(tables, before):
            return "refused", what, tables
    others = (key for key in tables if key != "CERTIFICATE_AXES")
    if all(key in before.tables and tables[key].tobytes() == before.tables[key].tobytes() for key in others):
        return "true", what, tables  # the same motion among the same arms
    formats = {key: list(of) for key, of in columns.items()}
    width = tables["PARAMETERS"].dtype["json"].itemsize
    formats["PARAMETERS"] = [("json", f"{width}A", None)]
    path = folder / "mutated.fits"
    path.write_bytes(sealed(formats, tables))
    try:
        plan = Plan.read(path)
    except FiberplanError:
        return "unreadable", what, tables
    true = is_safe(plan) and kind.is_true(plan, Claims(path.read_bytes()))
    return {True: "true", False: "false", None: "unreadable"}[true], what, tables


def none_is_accepted(rng, kind: Kind, folder, count: int = 50) -> None:
    """So many mutations of a base drawn at random: what the replay accepts of them is true."""
    name = rng.choice(list(kind.bases))
    for _ in range(count):
        outcome, what, _ = one_mutation(rng, kind, name, folder)
        assert outcome != "false", f"{name}: a false certificate is accepted after a mutation of {what}"
