"""Where a plan comes from, as its page says it: what no plan file says, since the same plan has the same file."""

import os
import time
from dataclasses import dataclass
from pathlib import Path

from fiberplan import __version__
from fiberplan.plan import Plan


@dataclass(frozen=True)
class Origin:
    """File and date, for the top of a page and for its title."""

    plan: str = ""  #: the plan's file
    date: str = ""  #: for people, such as "2026-11-26 21:15 UTC"

    @classmethod
    def of_file(cls, path: str | os.PathLike) -> "Origin":
        """Of a plan that was read: its file, and when that was written."""
        path = Path(path)
        return cls(path.name, said(path.stat().st_mtime))

    @classmethod
    def now(cls, plan: str | os.PathLike | None = None) -> "Origin":
        """Of a plan just made; dated by SOURCE_DATE_EPOCH where that is set, so that pages can be repeated."""
        epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
        moment = float(epoch) if epoch.isdigit() else time.time()
        return cls(Path(plan or "").name, said(moment))


def said(moment: float) -> str:
    """A moment [s since 1970] as people write it, in UTC, to the minute."""
    return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(moment))


def title(plan: Plan, origin: Origin) -> str:
    """What tells a page from others: design or file first, since tabs are narrow."""
    name = plan.problem.plane.name
    field = Path(plan.problem.source).stem or Path(origin.plan).stem
    return f"{field} on {name}" if field and field != name else name


def facts(plan: Plan, origin: Origin) -> list[tuple[str, str]]:
    """What is known of where a plan comes from: names and values, in order."""
    problem = plan.problem
    start = "as given" if problem.state is None else problem.state.source
    rows = (
        ("instrument", problem.plane.name),
        ("targets", Path(problem.source).name),
        ("start", Path(start).name or start),
        ("plan", origin.plan),
        ("planned by", f"{plan.planner}, seed {plan.seed}"),
        ("date", origin.date),
        ("fiberplan", __version__),
    )
    return [(name, value) for name, value in rows if value]
