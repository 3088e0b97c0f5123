"""The settings of every planner as options of the command line, with their units there.

A table rather than the planners' own fields, so that ``fiberplan --help`` need not load them; a test keeps the two
alike. An option that several planners have is one option.
"""

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

import typer


class Flag(NamedTuple):
    """One setting of one planner."""

    field: str  #: of the planner's dataclass; the option is --field with dashes
    kind: type  #: float, int, str or bool
    unit: str  #: on the command line: "deg" is converted to rad; "" if it has none
    help: str
    otherwise: str = ""  #: for a bool: the option that says no, if not --no-field

    @property
    def option(self) -> str:
        """Its name on the command line."""
        return "--" + self.field.replace("_", "-")


FLAGS: dict[str, tuple[Flag, ...]] = {
    "direct": (
        Flag("max_time", float, "s", "Give up what cannot be done in this time."),
        Flag("budget", float, "", "Replans per positioner before goals are given up; 60 if not given."),
        Flag("turn", float, "deg", "Turn of alpha in one step of the search; 6 if not given."),
    ),
    "prioritized-roadmap": (
        Flag("grid", str, "", "Cells of the roadmap over the two joint ranges; 8x6 if not given."),
        Flag("edges", int, "", "Random middle edges of a roadmap, at most; 24 if not given."),
        Flag("dt", float, "s", "Step; 6 if not given."),
        Flag("collision_dt", float, "s", "Longest time that one collision check stands for; 0.1 if not given."),
        Flag("max_stops", int, "", "Start-stops allowed for each arm; 1 if not given."),
        Flag("max_time", float, "s", "A motion takes less than this; 120 if not given."),
        Flag("orders", int, "", "Priority orders tried before a target is dropped; 8 if not given."),
        Flag("garages", bool, "", "An arm that fails may wait in a private garage, or not."),
        Flag("varying", bool, "", "Priorities may change in time, or not."),
        Flag("aside", bool, "", "An arm that has arrived may move aside, or not."),
        Flag("continuous", bool, "", "Check as rarely as the motion bound allows, or every --collision-dt."),
        Flag("early_abort", bool, "", "Leave out searches that cannot succeed, or not."),
    ),
    "greedy-fold": (
        Flag("step", float, "deg", "Step of the fastest joint; 0.1 if not given."),
        Flag("max_travel", float, "deg", "Give up after this much turn."),
        Flag("relief", str, "", "What to do about deadlocks: joint (default), reverse, replace or none."),
        Flag("skip_noops", bool, "", "Skip moves that do not move, or not.", "--literal"),
    ),
    "elliptic-navigation-function": (
        Flag("lambda1", float, "", "Pull to the goal, as part of the full speed; 1 if not given."),
        Flag("lambda2", float, "", "Push on zones in the outer half of an arm (rad/s mm2); 0.1 if not given."),
        Flag("lambda3", float, "", "Push on all other zones (rad/s mm2); 0.1 if not given."),
        Flag("influence", float, "mm", "Zones push from this far apart; 2 if not given."),
        Flag("spread", float, "", "How much larger the largest zones are taken for than the smallest; 0.1."),
        Flag("near", float, "s", "Two this near to their goals push each other less and less; 3 if not given."),
        Flag("calm", float, "s", "Whoever has come no nearer for this long pushes nobody; 1 if not given."),
        Flag("dt", float, "s", "Time step; 0.1 if not given."),
        Flag("relief", str, "", "What to do about deadlocks: layers (default) or none."),
        Flag("patience", float, "s", "Time without coming nearer that relief takes for stuck; 1 if not given."),
        Flag("max_time", float, "s", "The motion takes no longer; 600 if not given."),
    ),
    "navigation-function": (
        Flag("mode", str, "", "What arrives, repaired (default), or what the paper prints, literal."),
        Flag("lambda1", float, "", "Weight of attraction (per mm2) in the literal mode; 1 if not given."),
        Flag("lambda2", float, "", "Weight of repulsion in the literal mode; 0.05 if not given."),
        Flag("D", float, "mm", "Fiber ends nearer than this repel each other; 4 if not given."),
        Flag("d", float, "mm", "Safety distance of fiber ends, below D; 2 if not given."),
        Flag("dt", float, "s", "A step of the descent; 0.01 if not given."),
        Flag("convergence", float, "mm", "How near its target a fiber has converged; 0.1 if not given."),
        Flag("neighbours", int, "", "How many repel a fiber, the nearest; 0 (default): all within D."),
        Flag("ease", float, "", "Time that all take together, in times of the slowest joint; 1.25 if not given."),
        Flag("give_up", float, "", "Give up after so many times of the slowest joint; 6 if not given."),
    ),
}


def with_planner_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command one option for every setting in `FLAGS`, handed to it as one mapping, `settings`."""

    @functools.wraps(command)
    def with_options(**given: Any) -> None:
        command(**{name: given.pop(name) for name in own}, settings=given)

    signature = inspect.signature(command, eval_str=True)
    own = [name for name in signature.parameters if name != "settings"]
    parameters = [signature.parameters[name] for name in own]
    for field in dict.fromkeys(flag.field for flags in FLAGS.values() for flag in flags):
        users = {name: flag for name, flags in FLAGS.items() for flag in flags if flag.field == field}
        parameters.append(
            inspect.Parameter(field, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=_annotation(users))
        )
    with_options.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    with_options.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return with_options


def _annotation(users: dict[str, Flag]) -> Any:
    """What typer makes an option of; `users` are the planners that have it."""
    first = next(iter(users.values()))
    texts = {name: flag.help for name, flag in users.items()}
    alone = len(set(texts.values())) == 1
    option = typer.Option(
        f"{first.option}/{first.otherwise}" if first.otherwise else first.option,
        metavar=None if first.kind is bool else (first.unit or first.kind.__name__).upper(),
        help=next(iter(texts.values())) if alone else " ".join(f"{name}: {text}" for name, text in texts.items()),
        rich_help_panel=f"Options of {', '.join(users)}",
    )
    return Annotated[first.kind | None, option]
