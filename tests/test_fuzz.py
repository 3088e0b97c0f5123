"""A slice of the campaigns of `make fuzz`."""

import numpy as np
import pytest

from fuzz.campaigns import CAMPAIGNS

SLICE = {
    "proofs": 6,
    "planted": 3,
    "spared": 1,
    "barriers": 8,
    "mutations": 2,
    "losses": 2,
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
