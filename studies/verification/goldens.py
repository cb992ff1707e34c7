"""Keeps the numbers of many scenes, so that a change of the code that should change none of them can be seen to.

    python studies/verification/goldens.py --keep               every scene, into goldens.jsonl
    python studies/verification/goldens.py [--only everyday]    the same scenes again, compared with the file
    python studies/verification/goldens.py --random 40          the shipped scenes and the first 40 random ones

Shipped and everyday scenes give every number of `fem-impact strike --json`, and every number of every cell where they
hold a map; the first 500 random scenes of `effectivity.py` give those of the blow and its errors. A number holds if it
differs by at most 1e-9 of its size: Ritz vectors round in another way in every process, which shows at 3e-10. Stated
errors are differences of blows themselves and hold to 1 %. After more than three impacts motions are chaotic: there a
number holds if it differs by at most the stated error. Prints every number that does not hold, a line for each scene,
and how many hold; numbers that are new or gone are named once. The exit status says whether all hold.
"""

import contextlib
import io
import json
import math
import os
import re
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

os.environ.setdefault("NUMBA_DISABLE_JIT", "0")  # a first blow in plain Python rounds otherwise
os.environ.setdefault("OMP_NUM_THREADS", "1")  # another number rounds in another way, and so may an error by two

import effectivity
import xarray as xr

import fem_impact as fi
from fem_impact import cli

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

KEPT = Path(__file__).with_suffix(".jsonl")
RANDOM = 500  # [-] scenes of effectivity
SAME = 1e-9  # [-] rounding that a change of the order of sums may leave
SAME_ERROR = 1e-2  # [-] of stated errors
ERRORS = re.compile(r"error|trust|effect")
TINY = 1e-15  # [-] numbers this small are rounding themselves, as balances of energy and momentum are
# numbers of a random scene; the shipped ones give all
OF_A_BLOW = (
    "n_impacts", "margin", "contact_time", "peak_force", "impulse", "restitution", "energies", "spectral_centroid",
    "error",
)  # fmt: skip
DIGITS = 13  # [-] kept of a number
UNLIKE = re.compile(r"seconds|versions|balance|energy_error|momentum_error|\bformat\b|cost|memory")


def flat(values: Any, name: str = "") -> Iterator[tuple[str, float]]:
    """Every number and truth value of nested tables, with the path to it."""
    if isinstance(values, Mapping):
        for key, value in values.items():
            called = str(key) if not name else f"{name}.{key}"
            yield from flat(value, called)
    elif isinstance(values, list):
        for i, value in enumerate(values):
            key = value.get("name", i) if isinstance(value, Mapping) else i
            yield from flat(value, f"{name}.{key}")
    elif isinstance(values, bool | int | float) and not UNLIKE.search(name):
        yield name, float(f"{float(values):.{DIGITS}g}")


def said(*command: str) -> dict[str, Any]:
    """What a command prints with --json."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        cli.main([*command, "--json"])
    found: dict[str, Any] = json.loads(out.getvalue())
    return found


def shipped(path: Path) -> dict[str, float]:
    """Every number of a scene file."""
    numbers = dict(flat(said("strike", str(path))))
    if "[map" in path.read_text():
        with tempfile.TemporaryDirectory() as folder:
            said("map", str(path), "--out", folder)
            (written,) = Path(folder).glob("*.nc")
            with xr.open_dataset(written) as table:
                plain = [field for field in table.values() if field.dtype.kind in "fiub"]
                fields = {str(field.name): field.values.ravel().tolist() for field in plain}
            numbers |= {f"map: {name}": x for name, x in flat(fields)}
    return numbers


def drawn(number: int) -> dict[str, float]:
    """The numbers of a random scene."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(effectivity.random_scene(number).text)
        hit, _ = effectivity.struck(fi.load_scene(path))
    found = fi.export.numbers(hit)["response"]
    return dict(flat({name: found[name] for name in OF_A_BLOW}))


def numbers(only: str, most: int) -> Iterator[tuple[str, dict[str, float]]]:
    """Scenes by name, with their numbers; what a scene is refused with counts as a number of its own."""
    paths = [*sorted((shared.SCENES).glob("*.toml")), *sorted((shared.SCENES / "everyday").glob("*.toml"))]
    work: dict[str, Any] = {str(x.relative_to(shared.SCENES)): lambda x=x: shipped(x) for x in paths}
    work |= {f"random {n}": lambda n=n: drawn(n) for n in range(most)}
    for name, strike in work.items():
        if only not in name:
            continue
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", fi.ToleranceWarning)
                yield name, strike()
        except (ValueError, fi.SimulationError, effectivity.OverTime) as error:
            yield name, {f"refused: {type(error).__name__}": 1.0}


def apart(before: Mapping[str, float], after: Mapping[str, float]) -> dict[str, float]:
    """Relative differences of the numbers that do not hold."""
    chaotic = next((x for name, x in before.items() if name.endswith("n_impacts")), 0.0) > effectivity.CHAOTIC
    stated = next((x for name, x in before.items() if name.endswith(("error.total", "sequence.error"))), 0.0)
    allowed = max(SAME, stated) if chaotic else SAME
    found = {}
    for name in before.keys() & after.keys():
        one, other = before[name], after[name]
        if one == other or (math.isnan(one) and math.isnan(other)) or max(abs(one), abs(other)) < TINY:
            continue
        change = abs(one - other) / max(abs(one), abs(other))
        if not change <= (max(allowed, SAME_ERROR) if ERRORS.search(name) else allowed):
            found[name] = change
    return found


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line; the exit status."""
    parser = shared.parser(__doc__)
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--only", default="", help="part of a scene's name")
    parser.add_argument("--random", type=int, default=RANDOM)
    options = parser.parse_args(arguments)
    if options.keep:
        with KEPT.open("w") as file:
            for name, found in numbers(options.only, options.random):
                file.write(json.dumps({"scene": name, "numbers": found}) + "\n")
                file.flush()
        return 0
    kept = {row["scene"]: row["numbers"] for row in map(json.loads, KEPT.read_text().splitlines())}
    held, lost, gone, new = 0, 0, Counter[str](), Counter[str]()
    for name, after in numbers(options.only, options.random):
        before = kept[name]
        found = apart(before, after)
        held, lost = held + len(before.keys() & after.keys()) - len(found), lost + len(found)
        gone.update(before.keys() - after.keys())
        new.update(after.keys() - before.keys())
        if found:
            print(f"{name}: " + ", ".join(f"{key} {x:.1e}" for key, x in sorted(found.items(), key=lambda x: -x[1])))
    print(f"{held} numbers hold, {lost} do not")
    for word, names in (("gone", gone), ("new", new)):
        if names:
            print(f"{word}: " + ", ".join(f"{key} ({count})" for key, count in names.most_common()))
    return int(bool(lost or gone))


if __name__ == "__main__":
    sys.exit(main())
