"""Options that `fiberplan plan` had once, one for every setting of a planner: what to type now."""

from collections.abc import Sequence

_RENAMED = {"literal": ("skip_noops", "false")}


def removed_option(error: BaseException, arguments: Sequence[str]) -> str | None:
    """What stands in place of the option that the parser does not know; None if nothing does."""
    option = getattr(error, "option_name", None)
    if option is None or arguments[:1] != ["plan"] or not option.startswith("--"):
        return None
    from fiberplan.cli.settings import loaded_planners, settings_of

    name = option.removeprefix("--").replace("-", "_")
    known = {key: setting for make in loaded_planners().values() for key, setting in settings_of(make).items()}
    if name in _RENAMED:
        key, value = _RENAMED[name]
    elif name in known:
        key, value = name, "true" if known[name].kind is bool else _value_of(option, arguments)
    elif (key := name.removeprefix("no_")) in known and known[key].kind is bool:
        value = "false"
    else:
        return None
    return f"no such option: {option} is now --set {key}={value}"


def _value_of(option: str, arguments: Sequence[str]) -> str:
    """What was given for an option, if anything was."""
    for argument, following in zip(arguments, (*arguments[1:], ""), strict=True):
        if argument.startswith(f"{option}="):
            return argument.partition("=")[2]
        if argument == option and following and not following.startswith("--"):
            return following
    return "VALUE"
