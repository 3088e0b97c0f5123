"""Runs of the fields under each rule, judged by `verify` and by where fibers end."""

from dataclasses import dataclass
from time import process_time

import numpy as np

from fiberplan.plan import Outcome, Plan
from fiberplan.problem import Problem
from fiberplan.reproductions.makarem2014 import scenes
from fiberplan.reproductions.makarem2014.rules import RULES, Rule
from fiberplan.reproductions.makarem2014.scenes import Failure

SAMPLE = 0.05  #: [s] between looks at who has converged


@dataclass(frozen=True)
class Trial:
    """One run."""

    n: int
    cpu: float  #: of planning [s]
    motion_time: float  #: until the last of those that converge stays so [s]
    converged: float  #: share of fibers with a target that end within the convergence distance
    arrived: float  #: share that end exactly at their goals
    contacts: int
    proven: bool

    @classmethod
    def of(cls, plan: Plan, cpu: float) -> "Trial":
        """Judge a plan."""
        asked = np.array([outcome in (Outcome.ARRIVED, Outcome.DEADLOCKED) for outcome in plan.outcomes])
        when = converged_at(plan)[asked]
        stays = np.isfinite(when)
        return cls(
            n=plan.problem.n,
            cpu=cpu,
            motion_time=float(when[stays].max(initial=0.0)),
            converged=float(np.mean(stays)),
            arrived=len(plan.having(Outcome.ARRIVED)) / max(1, int(asked.sum())),
            contacts=len(plan.certificate.contacts),
            proven=plan.certificate.ok,
        )


def converged_at(plan: Plan) -> np.ndarray:
    """(n,) time from which each fiber stays within the convergence distance of its target [s]; inf: it does not."""
    plane, distance = plan.problem.plane, float(plan.parameters["convergence"])
    goals = plane.fibers(plan.problem.goal)
    when = np.zeros(plane.n)
    times = np.append(np.arange(0.0, plan.makespan, SAMPLE), plan.makespan)
    for k, t in enumerate(times):
        away = np.hypot(*(plane.fibers(plan.trajectory.at(t)) - goals).T)
        when[~(away <= distance)] = times[k + 1] if k + 1 < len(times) else np.inf
    return when


@dataclass(frozen=True)
class Runs:
    """Trials of one kind of field, and what failed."""

    trials: dict[tuple[Rule, int], list[Trial]]  #: by rule and rings
    failures: tuple[Failure, ...]


def run_uniform(rings: list[int], count: int, margin: float = 0.0, rules: tuple[Rule, ...] = RULES) -> Runs:
    """`count` uniform fields at each size, the same under every rule."""
    trials: dict[tuple[Rule, int], list[Trial]] = {(rule, size): [] for rule in rules for size in rings}
    failures: list[Failure] = []
    for size in rings:
        plane = scenes.array(size)
        for seed in range(count):
            problem = scenes.uniform(plane, seed, margin)
            for rule in rules:
                trials[rule, size].append(_trial(problem, rule, "uniform", size, seed, failures))
    return Runs(trials, tuple(failures))


def run_clustered(rings: int, count: int) -> Runs:
    """`count` moves along a chain of clustered fields, the same under every rule."""
    trials: dict[tuple[Rule, int], list[Trial]] = {(rule, rings): [] for rule in RULES}
    failures: list[Failure] = []
    for place, problem in enumerate(scenes.clustered(scenes.array(rings), count)):
        for rule in RULES:
            trials[rule, rings].append(_trial(problem, rule, "clustered", rings, place, failures))
    return Runs(trials, tuple(failures))


def _trial(problem: Problem, rule: Rule, field: str, rings: int, seed: int, failures: list[Failure]) -> Trial:
    begun = process_time()
    plan = rule.plan(problem)
    trial = Trial.of(plan, process_time() - begun)
    lost = tuple(problem.plane.ids[i] for i in plan.lost)
    if lost:
        failures.append(Failure(field, rings, seed, rule.name, lost))
    return trial
