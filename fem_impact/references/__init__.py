"""Reference cases: numbers known from elsewhere, what this program says of them, and whether its stated errors hold.

Start with `verify`. `cases.toml` holds what each case is, its source and its numbers; `case` compares, and
`frequencies` and `blows` compute.
"""

from collections.abc import Callable, Mapping, Sequence

from .._base import check
from . import blows, frequencies
from .case import Reference, ReferenceLine, ReferenceVerdict

CASES: Mapping[str, Reference] = {each.name: each for room in (frequencies, blows) for each in room.CASES}
__all__ = ["CASES", "Reference", "ReferenceLine", "ReferenceVerdict", "select", "verify"]


def select(names: str | Sequence[str] = "all") -> list[Reference]:
    """The cases called so, or whose names begin so; "all" for all.

    Raises
    ------
    ValueError
        If one of the names begins no case.
    """
    if isinstance(names, str) and names == "all":
        return list(CASES.values())
    words = check.tuple_of("names", [names] if isinstance(names, str) else names, str)
    for word in words:
        if not word or not any(name.startswith(word) for name in CASES):
            kinds = dict.fromkeys(name.partition("-")[0] for name in CASES)
            raise ValueError(
                f"names must begin as a case does, got {check.shown(word)}; there are {', '.join(kinds)} ..."
            )
    wanted = [word for word in words if word in CASES]
    begun = tuple(word for word in words if word not in CASES)
    return [case for name, case in CASES.items() if name in wanted or name.startswith(begun)]


@check.typed
def verify(
    names: str | Sequence[str] = "all", watch: Callable[[int, int], None] | None = None
) -> list[ReferenceVerdict]:
    """Compute reference cases on this machine.

    Parameters
    ----------
    names : str or sequence of str, optional
        Of cases, or how their names begin; all of them take a quarter of a minute.
    watch : callable, optional
        Called with how many cases of how many are done.

    Returns
    -------
    list of ReferenceVerdict
        Each with its numbers, their source, ours, our stated errors, and whether these hold.

    Raises
    ------
    ValueError
        If one of the names begins no case.

    Examples
    --------
    >>> [verdict] = fi.verify("wall-hertz")
    >>> verdict.holds, [line.quantity for line in verdict.lines]
    (True, ['contact time', 'peak force', 'restitution'])
    """
    cases = select(names)
    found = []
    for done, case in enumerate(cases):
        if watch is not None:
            watch(done, len(cases))
        found.append(case.compute())
    return found
