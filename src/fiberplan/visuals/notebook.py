"""Plans, focal planes and certificates as notebooks show them: a small drawing and the facts, light enough to commit.

The drawing is inline SVG. Up to 2,000 arms are lines from elbow to fiber, as wide as their bodies, one path a colour;
of more, fibers are dots. Coordinates are whole thousandths of the drawing, each given from the one before, so that 500
arms with their obstacles take about 13 kB, 5,000 dots 36 and 13,000 80. Every string of a plan is escaped.
"""

import html
from collections.abc import Iterable, Sequence

import numpy as np

from fiberplan.certificates import Certificate
from fiberplan.focal_plane import FocalPlane
from fiberplan.plan import Outcome, Plan
from fiberplan.plan.summary import headline
from fiberplan.visuals import style
from fiberplan.visuals.shapes import fixed_outlines, span

_SIZE = 1000  # units of a drawing's longer side
_SHOWN = 340  # [pixel] of it
_LINES = 2000  # arms that are drawn as lines
_OBSTACLES = 400  # that are drawn
_ROUND = 24  # corners of an outline that has arcs
_BARS = 24  # of a histogram
_LISTED = 8  # findings that are named


def plan_html(plan: Plan) -> str:
    """The end of a plan, coloured by outcome, lost targets crossed, beside its facts."""
    plane = plan.problem.plane
    colours = [style.OUTCOMES[outcome].light for outcome in plan.outcomes]
    lost = plane.fibers(plan.problem.requested)[plan.lost]
    drawing = _array(plane, plan.trajectory.end, colours, lost[np.isfinite(lost).all(axis=1)])
    names = [(style.LABELS[o], style.OUTCOMES[o].light) for o in style.OUTCOMES if o in set(plan.outcomes)]
    facts = [*headline(plan), ("proof", str(plan.certificate)), ("planner", plan.planner)]
    return _beside(drawing + _key(names), f"{plane.name}: plan", facts)


def focal_plane_html(plane: FocalPlane) -> str:
    """A focal plane with everyone folded, beside what it is made of."""
    offline = int((~plane.online).sum())
    colours = [style.OUTCOMES[Outcome.ARRIVED if on else Outcome.OFFLINE].light for on in plane.online]
    facts = [
        ("positioners", f"{plane.n}" + (f", {offline} of them cannot move" if offline else "")),
        ("kind of arm", plane.kinematics.name),
        ("bodies", ", ".join(body.name for body in plane.bodies) or "none: nothing can touch"),
        ("obstacles", str(len(plane.obstacles))),
        ("fibers", ", ".join(plane.fiber_offsets)),
        ("joint speeds", " and ".join(f"{_spread(np.degrees(plane.max_speed[:, k]))} deg/s" for k in (0, 1))),
    ]
    if plane.recommended_margin is not None:
        facts.append(("recommended margin", f"{plane.recommended_margin:g} mm"))
    return _beside(_array(plane, plane.folded, colours), f"{plane.name}: focal plane, folded", facts)


def certificate_html(certificate: Certificate) -> str:
    """The verdict, what was found, and how near pairs come at their closest."""
    facts = [
        ("verdict", str(certificate)),
        ("margin", f"{certificate.margin:g} mm"),
        ("clocks may be off by", f"{certificate.jitter:g} s"),
        ("arms may be off by", f"{certificate.position_error:g} mm"),
        ("pairs looked at", f"{len(certificate.pairs) + len(certificate.obstacle_pairs)}"),
    ]
    if certificate.geometry is not None:
        facts.append(("about", str(certificate.geometry)))
    for what, contacts in (("contact", certificate.contacts), ("undecided", certificate.undecided)):
        facts += [(what, f"{c.pair[0]} and {c.pair[1]} at {c.time:.3f} s") for c in contacts[:_LISTED]]
        if len(contacts) > _LISTED:
            facts.append((what, f"and {len(contacts) - _LISTED} more"))
    facts += [("violation", text) for text in certificate.violations[:_LISTED]]
    facts += [("assumed", text) for text in certificate.assumptions[:_LISTED]]
    return _beside(_histogram(certificate), "certificate", facts)


def _array(plane: FocalPlane, angles: np.ndarray, colours: Sequence[str], lost: np.ndarray | None = None) -> str:
    """A drawing of the array."""
    low, high = span(plane)
    scale = _SIZE / float((high - low).max())

    def placed(points: np.ndarray) -> np.ndarray:
        flipped = np.stack([points[..., 0] - low[0], high[1] - points[..., 1]], axis=-1)
        return np.rint(flipped * scale).astype(np.int64)

    width, height = np.ceil((high - low) * scale).astype(int)
    parts = [_outlined([placed(_coarse(outline)) for outline in fixed_outlines(plane)[:_OBSTACLES]])]
    fibers, elbows = placed(plane.fibers(angles)), placed(plane.elbows(angles))
    as_lines = plane.n <= _LINES
    body = next((body for body in plane.bodies if body.link == "beta"), None)
    thick = 2.0 * float(np.mean(body.radius)) if body is not None else 1.0
    stroke = max(2.0, thick * scale) if as_lines else max(2.0, 0.5 * _SIZE / np.sqrt(plane.n))
    for colour in dict.fromkeys(colours):
        mine = np.flatnonzero([c == colour for c in colours])
        path = _lines(elbows[mine], fibers[mine]) if as_lines else _dots(fibers[mine])
        parts.append(f'<path d="{path}" stroke="{colour}" stroke-width="{stroke:.3g}" stroke-linecap="round"/>')
    for x, y in placed(lost) if lost is not None else ():
        cross = f"M{x - 14} {y - 14}l28 28m0-28l-28 28"
        parts.append(f'<path d="{cross}" stroke="{style.CONTACT.light}" stroke-width="6"/>')
    return _svg(width, height, parts, "the array from above")


def _lines(begin: np.ndarray, end: np.ndarray) -> str:
    """Separate lines (k, 2) as path data, each given from the end of the one before."""
    last = np.concatenate([np.zeros((1, 2), np.int64), end[:-1]])
    return "".join(
        f"m{a} {b}l{c} {d}" for (a, b), (c, d) in zip((begin - last).tolist(), (end - begin).tolist(), strict=True)
    )


def _dots(points: np.ndarray) -> str:
    """Dots (k, 2) as path data: lines without length, which round ends make visible."""
    steps = np.diff(points, axis=0, prepend=np.zeros((1, 2), np.int64))
    return "".join(f"m{x} {y}h0" for x, y in steps.tolist())


def _coarse(outline: np.ndarray) -> np.ndarray:
    """Every third corner of an outline with arcs, which nobody tells apart at this size."""
    return outline[::3] if len(outline) >= _ROUND else outline


def _outlined(outlines: Iterable[np.ndarray]) -> str:
    """Filled outlines as one path."""
    path = "".join("M" + "L".join(f"{x} {y}" for x, y in outline.tolist()) + "z" for outline in outlines)
    return f'<path d="{path}" fill="{style.OBSTACLE.light}"/>' if path else ""


def _histogram(certificate: Certificate) -> str:
    """How many pairs come how near, up to 2 mm more than the margin."""
    gaps = np.concatenate([certificate.clearance, certificate.obstacle_clearance])
    edges = np.linspace(min(certificate.margin, float(gaps.min(initial=np.inf))), certificate.margin + 2.0, _BARS + 1)
    counts, _ = np.histogram(gaps[np.isfinite(gaps)], edges)
    if not counts.any():
        return ""
    wide, tall = _SIZE // _BARS, 400
    bars = "".join(
        f"M{k * wide} {tall}v-{round(tall * count / counts.max())}h{wide - 3}V{tall}z" for k, count in enumerate(counts)
    )
    words = f"{edges[0]:.2f} mm to {edges[-1]:.2f} mm: proven least clearance, {counts.sum()} of {len(gaps)} pairs"
    drawing = [f'<path d="{bars}" fill="{style.SERIES[0]}"/>']
    return _svg(_SIZE, tall, drawing, words) + f"<div>{_text(words)}</div>"


def _svg(width: int, height: int, parts: Sequence[str], words: str) -> str:
    """A drawing on white, in dark notebooks, too."""
    shown = _SHOWN * width // max(width, height)
    return (
        f'<svg role="img" aria-label="{_text(words)}" viewBox="0 0 {width} {height}" width="{shown}" '
        f'style="background:{style.PAPER.light}" fill="none">{"".join(parts)}</svg>'
    )


def _key(names: Sequence[tuple[str, str]]) -> str:
    """What colours mean."""
    squares = (f'<span style="color:{colour}">&#9632;</span>&nbsp;{_text(name)}' for name, colour in names)
    return f"<div>{' &ensp;'.join(squares)}</div>"


def _beside(drawing: str, title: str, facts: Sequence[tuple[str, str]]) -> str:
    """A drawing and a table of facts."""
    rows = "".join(
        f'<tr><th scope="row" style="text-align:left;vertical-align:top">{_text(name)}</th>'
        f'<td style="text-align:left">{_text(value)}</td></tr>'
        for name, value in facts
    )
    return (
        '<div style="display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start">'
        f"<div>{drawing}</div><div style='flex:1;min-width:20em'><b>{_text(title)}</b><table>{rows}</table></div></div>"
    )


def _spread(values: np.ndarray) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:g}" if np.isclose(low, high) else f"{low:g} to {high:g}"


def _text(value: object) -> str:
    return html.escape(str(value))
