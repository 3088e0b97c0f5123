"""One arm's motion on the clock: a path, and the step of it reached at each time."""

from dataclasses import dataclass

import numpy as np

from fiberplan.planners.prioritized_roadmap.roadmap import Path


@dataclass(frozen=True, eq=False)
class Motion:
    """A path and how far along it an arm is at each time until it arrives."""

    path: Path
    steps: np.ndarray  #: (arrival + 1,) index into the path at each step of the clock
    stops: int  #: start-stops, by Sabater2018's rule

    @property
    def arrival(self) -> int:
        """Step of the clock at which the end of the path is reached for good."""
        return len(self.steps) - 1

    def poses(self, times: int) -> np.ndarray:
        """(times, 2) configurations at each step of the clock [rad]."""
        index = np.minimum(np.arange(times), self.arrival)
        return self.path.configurations[self.steps[index]]

    def until(self, time: int) -> np.ndarray:
        """(time,) steps on the path before a step of the clock."""
        return self.steps[np.minimum(np.arange(time), self.arrival)]

    def state(self, time: int) -> tuple[int, int, int, int]:
        """(step on the path, start-stops so far, motion, time) at a step of the clock, as the search counts them."""
        stops = motion = 0
        for before, after in zip(self.steps[:time], self.steps[1 : time + 1], strict=False):
            action = int(after - before)
            stops += motion != 0 and action != motion
            motion = action
            if action == 1 and self.path.vertex[after]:
                stops, motion = stops + 1, 0
            if after == len(self.path.vertex) - 1:
                motion = 0
        return int(self.steps[min(time, self.arrival)]), stops, motion, time

    def knots(self, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Times (k,) [s] and configurations (k, 2) [rad], none where the joints go on turning as they did."""
        action = np.diff(self.steps)
        bends = self.path.vertex[self.steps[1:-1]] | (action[1:] != action[:-1])
        kept = np.concatenate([[0], 1 + np.flatnonzero(bends), [self.arrival] if self.arrival else []]).astype(np.int64)
        return kept * dt, self.path.configurations[self.steps[kept]]
