"""Options such as ``--require sky=80``: a number for each of several names."""

from collections.abc import Sequence

from fiberplan.errors import FiberplanError


def numbers_of(given: Sequence[str], option: str) -> dict[str, int]:
    """What an option says that is given several times.

    Raises:
        FiberplanError: it is not of the form CATEGORY=N, or names a category twice.
    """
    found: dict[str, int] = {}
    for text in given:
        name, _, count = text.partition("=")
        if not name or not count.isdecimal():
            raise FiberplanError(f"{option} {text}: expected CATEGORY=N, such as sky=80")
        if name in found:
            raise FiberplanError(f"{option} {text}: there is a number for {name} already")
        found[name] = int(count)
    return found
