"""What a scene is: a name, and one function from a seed to a problem."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import fiberplan as fp


@dataclass(frozen=True)
class Scene:
    """Problems of one kind, numbered by seed: the same seed is the same problem."""

    name: str
    make: Callable[[int, Path], fp.Problem]  #: of a seed and the folder of real data
    fields: int = 20  #: how many seeds a full table runs: 0, 1, ...
    finite: bool = False  #: whether there are no more fields than these
    quick: bool = False  #: whether it takes seconds whatever the planner
    needs: str | None = None  #: path in the folder of real data without which there is no scene

    @property
    def summary(self) -> str:
        """The first line of what its function says of itself."""
        return (self.make.__doc__ or "").strip().partition("\n")[0]

    def missing(self, data: Path) -> Path | None:
        """The path of real data that this scene needs and `data` does not have."""
        path = data / (self.needs or "")
        return path if self.needs and not path.exists() else None


def margin_of(buffer: float, radius: float = 1.5) -> float:
    """Margin [mm] of a buffer [mm], which is what papers call the thickened radius of an arm."""
    return 2.0 * (buffer - radius)
