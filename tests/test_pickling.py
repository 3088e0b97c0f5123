"""Pickles, copies and workers of a pool: the same objects, as little to be changed, with nothing compiled again."""

import copy
import json
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from numba.core import event

import fiberplan as fp
from fiberplan.arrays import FrozenDict
from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.shaping import quantize

WAYS = {
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
    "deepcopy": copy.deepcopy,
    "copy": copy.copy,
}  # fmt: skip


def arrays_in(thing, seen=()):
    """All arrays that can be come to from `thing`, with how."""
    if isinstance(thing, np.ndarray):
        yield ".".join(seen), thing
    elif isinstance(thing, dict):
        for key, value in thing.items():
            yield from arrays_in(value, (*seen, str(key)))
    elif isinstance(thing, tuple | list):
        for k, value in enumerate(thing):
            yield from arrays_in(value, (*seen, str(k)))
    elif hasattr(thing, "__dict__") and type(thing).__module__.startswith("fiberplan"):
        for name, value in vars(thing).items():
            yield from arrays_in(value, (*seen, name))


def things(small_plan):
    plane = small_plan.problem.plane
    targets = fp.Targets([1.0], [2.0], ("R0C1",), base=[[0.0, 0.0]])
    bar = FourBar([100.0], [50.0], [20.0], [90.0], [1.5])
    quantized = quantize(small_plan.trajectory, 4, plane=plane)[1]
    pin = fp.Obstacle("pin", [[0.0, 100.0]], 0.5)
    return [small_plan, plane, small_plan.problem, small_plan.trajectory, small_plan.certificate, plane.bodies[0], pin,
            targets, bar, quantized, fp.FocalPlane.load("miradas")]  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_copies_are_equal_and_read_only(way, small_plan):
    for thing in things(small_plan):
        again = WAYS[way](thing)
        given, made = dict(arrays_in(thing)), dict(arrays_in(again))
        assert made
        assert type(again) is type(thing)
        for name, array in made.items():
            assert not array.flags.writeable, (type(thing).__name__, name)
            assert array.base is None or not array.base.flags.writeable
            assert array.dtype == given[name].dtype
            assert np.array_equal(array, given[name], equal_nan=array.dtype.kind == "f")


@pytest.mark.parametrize("way", WAYS)
def test_what_was_cached_is_computed_anew(way, small_plan):
    assert small_plan.certificate.ok
    assert small_plan.lower_bound > 0
    assert len(small_plan.problem.plane.pairs)
    again = WAYS[way](small_plan)
    assert {"certificate", "lower_bound"}.isdisjoint(vars(again))
    if way != "copy":  # which has the same parts
        assert {"arms", "pairs", "reach", "_compiled", "index"}.isdisjoint(vars(again.problem.plane))
        assert "owner" not in vars(again.trajectory)
    assert again.certificate is not small_plan.certificate
    assert again.certificate.ok


def test_a_certificate_does_not_survive_a_changed_motion(small_plan):
    assert small_plan.certificate.ok
    state = small_plan.__getstate__()
    angles = small_plan.trajectory.angles.copy()
    angles[1] += 100.0
    state["trajectory"] = fp.Trajectory(small_plan.trajectory.offsets, small_plan.trajectory.times, angles)
    changed = object.__new__(fp.Plan)
    changed.__setstate__(state)
    assert not changed.certificate.ok


@pytest.mark.parametrize("way", WAYS)
def test_mappings_cannot_be_changed(way, small_plan):
    for plan in (small_plan, WAYS[way](small_plan)):
        assert plan.problem.plane.index["R0C1"] == 2
        held = {**vars(plan), **vars(plan.problem), **vars(plan.problem.plane)}
        for name in ("parameters", "blockers", "timings", "dropped", "fiber_offsets", "index"):
            mapping = held[name]
            assert mapping
            key = next(iter(mapping))
            for change in (
                lambda m, k: m.__setitem__(k, 1),
                lambda m, k: m.__delitem__(k),
                lambda m, k: m.pop(k),
                lambda m, k: m.update({k: 1}),
                lambda m, k: m.setdefault("new", 1),
                lambda m, k: m.__ior__({k: 1}),
                lambda m, k: m.clear(),
                lambda m, k: m.popitem(),
            ):
                with pytest.raises(TypeError, match="cannot be changed"):
                    change(mapping, key)


def test_frozen_dict_is_a_dict_for_everyone_else():
    given = {"a": [1, {"b": np.zeros(2)}]}
    frozen = FrozenDict(given)
    given["a"][1]["b"][:] = 1.0
    assert type(frozen["a"]) is tuple
    assert not frozen["a"][1]["b"].any()
    assert not frozen["a"][1]["b"].flags.writeable
    assert FrozenDict({"a": {"b": 1}}) == {"a": {"b": 1}}
    assert json.dumps(FrozenDict({"a": {"b": 1}})) == '{"a": {"b": 1}}'


class Compilations(event.Listener):
    def __init__(self):
        self.count = 0

    def on_start(self, event):
        self.count += 1

    def on_end(self, event):
        pass


def check_in_worker(plan):
    """In another process: what was compiled there, which arrays can be written to, and what was proven."""
    heard = Compilations()
    event.register("numba:compile", heard)
    proof = plan.certificate
    writeable = [name for name, array in arrays_in(plan) if array.flags.writeable]
    return heard.count, writeable, proof.ok, proof.smallest, plan


def test_workers_compile_nothing_and_cannot_write(small_plan):
    proof = small_plan.certificate  # compiled here, if not before
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        compiled, writeable, ok, smallest, back = pool.submit(check_in_worker, small_plan).result()
    assert compiled == 0
    assert writeable == []
    assert (ok, smallest) == (True, proof.smallest)
    assert [name for name, array in arrays_in(back) if array.flags.writeable] == []
