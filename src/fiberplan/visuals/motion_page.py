"""The page of a motion that is no plan, such as one that is audited: nobody has a target; who moves is told apart."""

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from fiberplan import __version__
from fiberplan.certificates import Certificate
from fiberplan.errors import FiberplanError
from fiberplan.focal_plane import FocalPlane
from fiberplan.motion import Executed
from fiberplan.tables.atomic import write_whole
from fiberplan.visuals.packing import packed
from fiberplan.visuals.page import assembled
from fiberplan.visuals.plane_data import motion_data, plane_data
from fiberplan.visuals.proof_data import proof_data

_KINDS = (
    ("arrived", "moves", "turns a joint"),
    ("no-target", "rests", "stays where it is"),
    ("offline", "offline", "cannot move, or the file does not move it"),
)


def show_motion(
    plane: FocalPlane,
    executed: Executed,
    certificate: Certificate,
    path: str | os.PathLike,
    title: str,
    origin: Sequence[tuple[str, str]] = (),
) -> None:
    """Write the page of a motion to `path`.

    Args:
        plane: whose positioners move.
        executed: what they do.
        certificate: of this motion.
        path: of the page.
        title: what tells it from others.
        origin: names and values of where it comes from.

    Raises:
        FiberplanError: the file cannot be written; what was there before is kept.
    """
    write_whole(path, assembled([motion_page_data(plane, executed, certificate, title, origin)]), FiberplanError)


def motion_page_data(
    plane: FocalPlane, executed: Executed, certificate: Certificate, title: str, origin: Sequence[tuple[str, str]] = ()
) -> dict[str, Any]:
    """Everything the page of a motion shows, ready for `json.dumps`."""
    motion = executed.trajectory
    turned = np.zeros(plane.n, bool)
    within = motion.owner[1:] == motion.owner[:-1]
    turned[motion.owner[1:][within & (np.diff(motion.angles, axis=0) != 0).any(axis=1)]] = True
    kind = np.where(turned, 0, np.where(plane.online & executed.online, 1, 2))
    return {
        **plane_data(plane),
        **motion_data(motion),
        **proof_data(plane, motion, certificate),
        "title": title,
        "origin": [("instrument", plane.name), *origin, ("fiberplan", __version__)],
        "summary": f"{turned.sum()} of {plane.n} move in {motion.duration:.1f} s",
        "notes": list(dict.fromkeys((*executed.notes, *plane.notes))),
        "margin": certificate.margin,
        "outcomes": [{"key": k, "label": label, "meaning": what, "lost": False} for k, label, what in _KINDS],
        "outcome": packed(kind, "u1"),
        "priority": packed(np.ones(plane.n), "<f4"),
        "goal": packed(np.full((plane.n, 2), np.nan), "<f4"),
        "losses": [],
        "displaced": [],
    }
