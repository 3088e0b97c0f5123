"""Names that are registered where a thing is defined, here or in another package, and found by name from above.

A `Registry` maps names to instruments, planners, controllers or file formats. Ours are registered by a decorator beside
their definition; another package names its own in the entry points of the registry's group, and they are imported when
they are asked for, not before. `io_function` and `notebook_function` are the other use of names: imports run downward,
yet `FocalPlane.load` has to end in the reader of some instrument's files, and a plan in a drawing, which lie above.
"""

import difflib
import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar

from fiberplan.errors import FiberplanError

T = TypeVar("T")


class Registry(Mapping[str, T], Generic[T]):
    """A read-only mapping: ours in a fixed order, then those of other packages by name.

    Args:
        kind: what is registered, for messages: "planner".
        group: of entry points in which other packages name theirs.
        order: of ours; those not named follow in the order of their registration.
    """

    def __init__(self, kind: str, group: str, order: Sequence[str] = ()):
        self.kind, self.group, self._order = kind, group, tuple(order)
        self._own: dict[str, T] = {}
        self._others: dict[str, EntryPoint] | None = None

    def register(self, name: str) -> Callable[[T], T]:
        """A decorator that registers what it decorates under `name`."""

        def registered(thing: T) -> T:
            if name in self._own and self._own[name] is not thing:
                raise ValueError(f"{self.kind} '{name}' is registered already")
            self._own[name] = thing
            place = {each: k for k, each in enumerate(self._order)}
            ordered = sorted(self._own, key=lambda each: place.get(each, len(place)))  # stable
            self._own = {each: self._own[each] for each in ordered}
            return thing

        return registered

    def _found(self) -> Mapping[str, EntryPoint]:
        """Entry points of other packages; a name of ours cannot be taken over."""
        if self._others is None:
            found = sorted(entry_points(group=self.group), key=lambda point: (point.name, point.value))
            self._others = {point.name: point for point in found if point.name not in self._own}
        return self._others

    def __getitem__(self, name: str) -> T:
        """What is registered under `name`.

        Raises:
            KeyError: nothing is.
            FiberplanError: another package names it, but it cannot be imported; one line that says which.
        """
        if name in self._own:
            return self._own[name]
        point = self._found()[name]
        try:
            return point.load()
        except Exception as error:  # whatever another package's import raises
            reason = " ".join(str(error).split()) or type(error).__name__
            raise FiberplanError(f"{self.kind} '{name}' ({point.value}) cannot be imported: {reason}") from error

    def find(self, name: str) -> T:
        """What is registered under `name`.

        Raises:
            FiberplanError: nothing is, or it cannot be imported; one line that says what there is.
        """
        if name in self:
            return self[name]
        close = difflib.get_close_matches(name.lower(), list(self), n=1, cutoff=0.6)
        hint = f"did you mean '{close[0]}'?" if close else f"there are {', '.join(self)}"
        raise FiberplanError(f"no {self.kind} '{name}'; {hint}")

    def __iter__(self) -> Iterator[str]:
        return iter((*self._own, *self._found()))

    def __len__(self) -> int:
        return len(self._own) + len(self._found())

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self._found()

    def __repr__(self) -> str:
        return f"<{self.kind}s: {', '.join(self)}>"


def io_function(name: str) -> Callable[..., Any]:
    """A function of `fiberplan.io`, by name."""
    return _function("fiberplan.io", name)


def hardware_function(name: str) -> Callable[..., Any]:
    """A function of `fiberplan.hardware.audit`, by name: what a controller's file makes robots do is read above."""
    return _function("fiberplan.hardware.audit", name)


def notebook_function(name: str) -> Callable[..., str]:
    """A function of `fiberplan.visuals.notebook`, by name: what objects show of themselves is drawn above them."""
    return _function("fiberplan.visuals.notebook", name)


def _function(module: str, name: str) -> Callable[..., Any]:
    function: Callable[..., Any] = getattr(importlib.import_module(module), name)
    return function
