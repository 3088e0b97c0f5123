"""Every planner, and the proof of its plan, with every array access checked: `make bounds`."""

import pytest
from numba.core import config

from fiberplan.scenes.decisive import exchange
from problems import among_obstacles, offline_across
from test_promises import VARIANTS, planner_of


@pytest.mark.skipif(not config.BOUNDSCHECK, reason="array accesses are not checked: see `make bounds`")
@pytest.mark.parametrize("scene", [exchange, offline_across, among_obstacles], ids=lambda s: s.__name__)
@pytest.mark.parametrize("variant", [pytest.param(v, marks=pytest.mark.xdist_group(VARIANTS[v][0])) for v in VARIANTS])
def test_no_planner_reads_or_writes_past_an_array(variant, scene):
    assert planner_of(variant).plan(scene()).faults() == []
