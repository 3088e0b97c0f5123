"""What can go wrong, with the facts attached.

A user's mistake is a ``FiberplanError``: one line that names the file, row, column and value. A positioner that
cannot arrive is not an error but an outcome (see `fiberplan.plan.Outcome`).
"""


class FiberplanError(Exception):
    """Base of every error that a user's input can cause; its text is one line."""


class InstrumentError(FiberplanError):
    """An instrument name, file or value that cannot be used."""


class TargetError(FiberplanError):
    """A table of targets that cannot be used."""


class ProblemError(FiberplanError):
    """A start or goal that no plan can begin or end with.

    Attributes:
        positioners: indices of the positioners the message is about.
    """

    def __init__(self, message: str, positioners: tuple[int, ...] = ()):
        super().__init__(message)
        self.positioners = positioners


class PlanError(FiberplanError):
    """A plan file that cannot be read or written."""


class UnprovenError(PlanError):
    """A file for a controller that is not left behind: what it makes the motors do is not proven safe.

    Attributes:
        certificate: what was found; None where the motion begins or ends elsewhere than the plan.
    """

    def __init__(self, message: str, certificate: object = None):
        super().__init__(message)
        self.certificate = certificate


class UnknownPositionerError(PlanError, KeyError):
    """A positioner that a plan does not have."""

    def __str__(self) -> str:
        return Exception.__str__(self)  # a KeyError would put its text in quotes


class TrajectoryError(FiberplanError):
    """Knots that do not make a trajectory."""


def interrupted(error: BaseException) -> bool:
    """Whether an error is Ctrl-C or comes of it, by cause or context.

    An interrupt within a compiled kernel surfaces as a SystemError whose cause it is; one within an import or a
    callback, as whatever was raised on the way out.
    """
    todo: list[BaseException | None] = [error]
    seen: set[int] = set()
    while todo:
        one = todo.pop()
        if isinstance(one, KeyboardInterrupt):
            return True
        if one is not None and id(one) not in seen:
            seen.add(id(one))
            todo += [one.__cause__, one.__context__, *getattr(one, "exceptions", ())]
    return False
