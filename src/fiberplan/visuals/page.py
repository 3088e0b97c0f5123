"""One self-contained HTML page for a plan: an operator sees whether it is safe, what is lost and why.

The page is a template, a style sheet and a few scripts (package data beside this module) around the plan as compact
data. It asks for nothing over the network, and says so to the browser. Every string of the plan reaches the document
as text, never as markup: ids and notes come from files.
"""

import base64
import hashlib
import html
import json
import os
from collections.abc import Sequence
from importlib.resources import files
from itertools import zip_longest
from typing import Any

from fiberplan.errors import PlanError
from fiberplan.plan import Plan
from fiberplan.tables.atomic import write_whole
from fiberplan.visuals import style
from fiberplan.visuals.origin import Origin
from fiberplan.visuals.page_data import page_data

SCRIPTS = (
    "words.js",
    "model.js",
    "motion.js",
    "gaps.js",
    "zone.js",
    "clearances.js",
    "detail.js",
    "colouring.js",
    "view.js",
    "marks.js",
    "targets.js",
    "scene.js",
    "strips.js",
    "timeline.js",
    "header.js",
    "selected.js",
    "lists.js",
    "panel.js",
    "share.js",
    "controls.js",
    "main.js",
)
MOST = 2  #: plans on one page


def show(plan: Plan | Sequence[Plan], path: str | os.PathLike, origin: Origin | Sequence[Origin] = ()) -> None:
    """Write the page of `plan`, or of two plans side by side, to `path`.

    Args:
        plan: one, or two to compare: they share time and view.
        path: of the page.
        origin: of each plan, where it comes from: files and date, for title and heading.

    Raises:
        PlanError: the file cannot be written; what was there before is kept. Or more than two plans.
    """
    plans = (plan,) if isinstance(plan, Plan) else tuple(plan)
    origins = (origin,) if isinstance(origin, Origin) else tuple(origin)
    if not 1 <= len(plans) <= MOST:
        raise PlanError(f"a page shows one plan or two, not {len(plans)}")
    write_whole(path, render(plans, origins))


def render(plans: Sequence[Plan], origins: Sequence[Origin] = ()) -> bytes:
    """The page of one or two plans, in ASCII."""
    return assembled([page_data(plan, origin) for plan, origin in zip_longest(plans, origins)])


def assembled(data: list[dict[str, Any]]) -> bytes:
    """The page around the data of one or two plans."""
    script = '"use strict";\n(() => {\n' + "\n".join(_asset(name) for name in SCRIPTS) + "\n})();\n"
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    date = [value for name, value in data[0]["origin"] if name == "date"]
    parts = {
        "TITLE": html.escape(" | ".join(", ".join([one["title"], *date, one["summary"]]) for one in data)),
        "POLICY": f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; img-src data:",
        "STYLE": palette() + _asset("page.css"),
        "WITHOUT_SCRIPT": html.escape(
            " ".join(f"{one['title']}. {one['summary']}. {one['certificate']['statement']}." for one in data)
        ),
        "PLAN": _inert_json({"plans": data}),
        "SCRIPT": script,
    }
    page = _asset("page.html")
    pieces = page.split("%%")  # text, key, text, key, ... so that nothing inserted is looked at again
    filled = [parts[piece] if k % 2 else piece for k, piece in enumerate(pieces)]
    return "".join(filled).encode("ascii", "xmlcharrefreplace")


def palette() -> str:
    """The shared colours as CSS custom properties, light by default and dark where the reader prefers it."""
    names = {style.css_name(outcome): colour for outcome, colour in style.OUTCOMES.items()}
    for name in ("CONTACT", "SAFE", "INK", "MUTED", "LINE", "PAPER", "OBSTACLE"):
        names[name.lower()] = getattr(style, name)
    names |= {f"ramp-{k}": colour for k, colour in enumerate(style.RAMP)}
    light = "".join(f"--{name}:{colour.light};" for name, colour in names.items())
    dark = "".join(f"--{name}:{colour.dark};" for name, colour in names.items())
    return f":root{{{light}}}\n@media (prefers-color-scheme: dark){{:root{{{dark}}}}}\n"


def _asset(name: str) -> str:
    return files("fiberplan.visuals").joinpath("assets", name).read_text("ascii")


def _inert_json(data: dict) -> str:
    """JSON that cannot end the element it stands in, nor open another."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
