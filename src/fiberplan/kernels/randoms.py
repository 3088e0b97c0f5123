"""Random numbers that are the same on every platform."""

import numpy as np

from fiberplan.kernels.compile import inlined


@inlined
def uniform(state):
    """Uniform in [0, 1) from a splitmix64 generator whose state is state[0] (the same on every platform)."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) / 9007199254740992.0
