"""Attacks the promise of every blow: random blows against a reference of their own, near thresholds, maps, edges.

    python studies/attack.py [--area everyday] [--first 0] [--count 0] [--file attack.csv] [--truths folder] [--seed 1]

Attacks with so many numbers of an area, from the first on: a number is a blow on modes or on a disk of finite elements,
a threshold with sixty blows beside it, or a map with thirty of its cells. A line for each blow is appended to the
file; numbers that it has already are left out, so a run goes on where another stopped. Then prints the table of all
lines: how many misses were silent, how many numbers of impacts were wrong and told as met, how far truths lay above
claims, and every such blow with all its numbers. Without --count it only does this.

The truth of a blow is an integrator that shares no code with the package, `tests/independent/modal_motion.py`: it
states its own error. Where that is above a tenth of the tolerance the blow is not judged; where it is above half the
difference found, the blow is left out of claim over truth, of which the table tells how many blows are in it. With a
folder for truths they are kept there, so that the same blows can be struck again after a change for the cost of the
blows alone.
"""

import argparse
import csv
import sys
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "independent"))
import attack_blows  # noqa: E402  found by the line above


def read(path: Path) -> list[attack_blows.Verdict]:
    """The lines of a file."""
    kinds: dict[Any, Any] = {str: str, int: int, float: float, bool: "True".__eq__}
    each = fields(attack_blows.Verdict)
    with path.open(newline="") as file:
        return [attack_blows.Verdict(*(kinds[x.type](row[x.name]) for x in each)) for row in csv.DictReader(file)]


def main(arguments: list[str] | None = None) -> list[attack_blows.Verdict]:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--area", choices=list(attack_blows.AREAS), default="everyday")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--file", type=Path, default=Path("attack.csv"))
    parser.add_argument("--truths", type=Path)
    options = parser.parse_args(arguments)
    truths = attack_blows.Truths(options.truths and options.truths / str(options.seed))
    done = {(x.area, x.number) for x in read(options.file)} if options.file.exists() else set()
    for number in range(options.first, options.first + options.count):
        if (options.area, number) in done:
            continue
        found = list(attack_blows.attack(options.area, number, truths, seed=options.seed))
        new = not options.file.exists()
        with options.file.open("a", newline="") as file:
            writer = csv.DictWriter(file, [x.name for x in fields(attack_blows.Verdict)])
            if new:
                writer.writeheader()
            writer.writerows(map(asdict, found))
    verdicts = read(options.file) if options.file.exists() else []
    print(attack_blows.table(verdicts))
    return verdicts


if __name__ == "__main__":
    main()
