"""Every planner, and the proof of its plan, with every array access checked: `make bounds`."""

import pytest
from numba.core import config

from fiberplan.planners import PLANNERS
from test_planners import SETTINGS, among_obstacles, exchange, offline_across


@pytest.mark.skipif(not config.BOUNDSCHECK, reason="array accesses are not checked: see `make bounds`")
@pytest.mark.parametrize("scene", [exchange, offline_across, among_obstacles], ids=lambda s: s.__name__)
@pytest.mark.parametrize("name", PLANNERS)
def test_no_planner_reads_or_writes_past_an_array(name, scene):
    for settings in SETTINGS[name]:
        plan = PLANNERS[name](**settings).plan(scene())
        assert plan.faults() == []
