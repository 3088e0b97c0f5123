"""A slice of the campaigns of `make fuzz`."""

import numpy as np
import pytest

from fiberplan.certificates import replay_infeasible
from fuzz.campaigns import CAMPAIGNS
from fuzz.losses import BASES, is_true
from fuzz.made_false import Kind, one_mutation, restate, set_margin

SLICE = {
    "proofs": 6,
    "planted": 3,
    "spared": 1,
    "barriers": 8,
    "mutations": 2,
    "losses": 1,
    "outlines": 150,
    "plans": 25,
    "files": 12,
}
SLICE |= {"amendments": 6, "interrupts": 6, "audits": 1}


def test_every_campaign_has_a_slice():
    assert set(SLICE) == set(CAMPAIGNS)


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_campaign_finds_nothing(name, tmp_path):
    for seed in range(SLICE[name]):
        CAMPAIGNS[name](np.random.default_rng(seed), tmp_path)


@pytest.mark.parametrize("name", ["pocket", "facing", "three"])
def test_a_proof_made_false_is_told_if_it_is_accepted(name, tmp_path, monkeypatch):
    """At margin 0 there is a way past; a replay that believes what is called blocked does not notice."""

    def no_margin(rng, tables):
        restate(tables, lambda said: set_margin(said, 0.0))

    kind, rng = Kind({name: BASES[name]}, no_margin, is_true), np.random.default_rng(0)
    assert one_mutation(rng, kind, name, tmp_path)[0] == "refused"
    monkeypatch.setattr(replay_infeasible, "is_blocked", lambda *said: True)
    assert one_mutation(rng, kind, name, tmp_path)[0] == "false"
