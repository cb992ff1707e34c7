"""How well the numbers of a scene are known: ``{ value = 70e9, about = 0.03 }`` or ``{ value, low, high }``."""

from collections.abc import Mapping
from typing import Any

from . import check

# [-] standard deviations from the middle within which nine tenths of a normal distribution lie
NINETY = 1.6448536269514722
WITHIN = ("rise", "hand", "material")  # tables within others whose numbers may have intervals, too
FORMS = ({"value", "about"}, {"value", "low", "high"})


def taken(table: str, values: Any) -> tuple[Any, dict[str, Any]]:
    """The values of a table as single numbers, and the distributions of those that have an interval, by table.key.

    Tables in a list have their number before the key.
    """
    if isinstance(values, list):
        pairs = [taken(f"{table}.{i}", each) for i, each in enumerate(values)]
        return [pair[0] for pair in pairs], {name: how for pair in pairs for name, how in pair[1].items()}
    if not isinstance(values, Mapping):
        return values, {}
    plain, known = dict(values), {}
    for key, value in values.items():
        if isinstance(value, Mapping) and set(value) in FORMS:
            known[f"{table}.{key}"] = distribution(key, value)
            plain[key] = value["value"]
        elif isinstance(value, Mapping) and key in WITHIN:
            plain[key], within = taken(f"{table}.{key}", value)
            known |= within
    return plain, known


def distribution(key: str, interval: Mapping[str, Any]) -> tuple[str, float, float]:
    """The distribution of a number, as `fem_impact.spread` takes it.

    ``about`` is the share [-] by which nine tenths of all values lie within the value: lognormal. ``low`` and ``high``
    are the ends of what is possible: uniform.
    """
    value = check.number(f"{key}.value", interval["value"])
    if "about" in interval:
        share = check.positive(f"{key}.about", interval["about"])
        if not (value > 0.0 and share < 1.0):
            raise ValueError(
                f"{key}.about must be a share below 1 of a positive value, got {share:g} of {value:g}; give low, high"
            )
        return "lognormal", value, share / NINETY
    low, high = (check.number(f"{key}.{end}", interval[end]) for end in ("low", "high"))
    if not low <= value <= high or low == high:
        raise ValueError(f"{key}.value must lie between low and high, got {value:g}, {low:g} and {high:g}")
    return "uniform", low, high
