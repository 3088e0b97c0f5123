"""Numbers in messages with as many digits as it takes to see that they differ."""

_MOST = 15
_LONG = 1e7  # from here on digits before the point say nothing any more


def told_apart(value: float, *edges: float, digits: int = 3, kind: str = "f") -> tuple[str, ...]:
    """`value` and each of `edges` as text, with enough digits that no edge reads like the value unless it equals it.

    Args:
        value: what is complained of.
        edges: what it is held against.
        digits: at least so many.
        kind: "f" counts decimals, "g" significant digits.
    """
    if max(abs(value), *map(abs, edges)) >= _LONG:
        kind = "g"
    while True:
        said, *ends = (f"{number:.{digits}{kind}}" for number in (value, *edges))
        alike = any(end == said and edge != value for end, edge in zip(ends, edges, strict=True))
        if not alike or digits >= _MOST:
            return (said, *ends)
        digits += 1
