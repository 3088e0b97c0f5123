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
from importlib.resources import files

from fiberplan.plan import Plan
from fiberplan.tables.atomic import write_whole
from fiberplan.visuals import style
from fiberplan.visuals.page_data import page_data

SCRIPTS = (
    "data.js",
    "motion.js",
    "clearance.js",
    "view.js",
    "zone.js",
    "scene.js",
    "timeline.js",
    "panel.js",
    "premises.js",
    "main.js",
)


def show(plan: Plan, path: str | os.PathLike) -> None:
    """Write the page of `plan` to `path`.

    Raises:
        PlanError: the file cannot be written; what was there before is kept.
    """
    write_whole(path, render(plan))


def render(plan: Plan) -> bytes:
    """The page of `plan`, in ASCII."""
    data = page_data(plan)
    script = '"use strict";\n(() => {\n' + "\n".join(_asset(name) for name in SCRIPTS) + "\n})();\n"
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    parts = {
        "TITLE": html.escape(f"{data['name']}: {data['summary']}"),
        "POLICY": f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; img-src data:",
        "STYLE": palette() + _asset("page.css"),
        "WITHOUT_SCRIPT": html.escape(f"{data['name']}. {data['summary']}. {data['certificate']['statement']}"),
        "PLAN": _inert_json(data),
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
    light = "".join(f"--{name}:{colour.light};" for name, colour in names.items())
    dark = "".join(f"--{name}:{colour.dark};" for name, colour in names.items())
    return f":root{{{light}}}\n@media (prefers-color-scheme: dark){{:root{{{dark}}}}}\n"


def _asset(name: str) -> str:
    return files("fiberplan.visuals").joinpath("assets", name).read_text("ascii")


def _inert_json(data: dict) -> str:
    """JSON that cannot end the element it stands in, nor open another."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
