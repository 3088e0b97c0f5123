"""Certify the bytes: an export is finished only when what is read back from the written file is proven safe.

The proof is of the motion that the file causes, by the controller's own reader, at the plan's margin less a stated
allowance: for rounding, for the pieces that ramps are chopped into, for clocks. It also holds the executed motion
against the plan: where it begins, and where it ends.
"""

import os
from collections.abc import Callable, Mapping, Sized
from typing import Any

import numpy as np

from fiberplan.arrays import not_negative
from fiberplan.certificates import Certificate, verify
from fiberplan.errors import PlanError, UnprovenError
from fiberplan.hardware.controller import HandedOver
from fiberplan.motion import Executed
from fiberplan.plan import Plan
from fiberplan.problem import State
from fiberplan.tables.atomic import write_whole

ALLOWANCE = 0.05  #: an executed motion may keep this much less clearance than the plan [mm]
LANDING = 0.01  #: a fiber ends this close to where the plan ends [mm]
_SHOWN = 3  # findings that a refusal lists


def hand_over(
    plan: Plan,
    path: str | os.PathLike,
    content: bytes,
    decode: Callable[[bytes, State], Executed],
    allowance: float,
    facts: Mapping[str, Any],
    prove: Callable[..., Certificate] = verify,
) -> HandedOver:
    """Write `content` to `path` if what `decode` makes of the written bytes is proven safe, and is the plan's motion.

    Args:
        plan: what was encoded.
        path: of the file.
        content: what the controller's `encode` made.
        decode: the controller's reader, from bytes and the state before.
        allowance: the executed motion may keep this much less than the plan's margin [mm].
        facts: to return with the proof.
        prove: what proves it, called as `verify`.

    Raises:
        UnprovenError: the executed motion is not proven, or begins or ends elsewhere.
        PlanError: the file cannot be written.
    """
    proven: list[HandedOver] = []

    def check(written: bytes) -> None:
        proven.append(proven_bytes(plan, os.fspath(path), written, decode, allowance, facts, prove))

    write_whole(path, content, PlanError, check)
    return proven[-1]


def proven_bytes(
    plan: Plan,
    name: str,
    content: bytes,
    decode: Callable[[bytes, State], Executed],
    allowance: float,
    facts: Mapping[str, Any],
    prove: Callable[..., Certificate] = verify,
) -> HandedOver:
    """What `decode` makes of `content`, proven safe and the plan's motion; arguments as of `hand_over`.

    Raises:
        UnprovenError: the executed motion is not proven, or begins or ends elsewhere.
        PlanError: an allowance that is negative or not finite.
    """
    allowance = not_negative(allowance, "mm", "allowance", PlanError)
    executed = decode(content, plan.state_at(0.0))
    refuse_other_ends(plan, executed, name)
    certificate = certify(plan, executed, allowance, prove)
    if not certificate.ok:
        found = said(plan, certificate)
        raise UnprovenError(f"{name}: not written: what the motors would do is {found}", certificate)
    return HandedOver(executed, certificate, facts)


def certify(
    plan: Plan, executed: Executed, allowance: float = ALLOWANCE, prove: Callable[..., Certificate] = verify
) -> Certificate:
    """Proof of an executed motion at the plan's margin less an allowance [mm], 0 at least."""
    problem = plan.problem
    assert problem.position_error is not None  # set on construction
    return prove(
        problem.plane,
        executed,
        max(0.0, problem.margin - allowance),
        position_error=problem.position_error,
        opening=problem.near_start == "open" or problem.needs_opening,
    )


def refuse_empty(made: Sized, path: str | os.PathLike, what: str) -> None:
    """Refuse to write a file that moves nobody, which its reader would take for a damaged one.

    Raises:
        PlanError: naming the file and `what` it lacks.
    """
    if not len(made):
        raise PlanError(f"{os.fspath(path)}: nobody turns: {what}")


def refuse_other_ends(plan: Plan, executed: Executed, name: str) -> None:
    """Refuse a motion whose fibers begin or end farther than `LANDING` from where the plan's do.

    Raises:
        UnprovenError: naming the worst robot.
    """
    plane, motion = plan.problem.plane, executed.trajectory
    for what, made, meant in (
        ("begin", motion.start, plan.trajectory.start),
        ("end", motion.end, plan.trajectory.end),
    ):
        away = np.hypot(*(plane.fibers(made) - plane.fibers(meant)).T)
        worst = int(np.argmax(away))
        if not away[worst] <= LANDING:
            raise UnprovenError(
                f"{name}: not written: positioner '{plane.ids[worst]}' would {what} {away[worst]:.4f} mm "
                f"from where the plan has it, {LANDING:g} mm is allowed"
            )


def said(plan: Plan, certificate: Certificate) -> str:
    """What is wrong with a motion, in one line, with the first findings."""
    label = plan.problem.plane.label
    found = [
        f"{label(c.pair[0])} and {label(c.pair[1])} at {c.time:.3f} s, clearance {c.clearance:.4f} mm"
        for c in (*certificate.contacts, *certificate.undecided)
    ]
    found += certificate.violations
    more = f"; and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return f"{certificate} (margin {certificate.margin:g} mm): {'; '.join(found[:_SHOWN])}{more}"
