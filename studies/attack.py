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

import sys
from pathlib import Path

import shared

sys.path.insert(0, str(shared.STUDIES.parent / "tests" / "independent"))
import attack_blows


def main(arguments: list[str] | None = None) -> list[attack_blows.Verdict]:
    """Run the study from the command line."""
    parser = shared.parser(__doc__)
    parser.add_argument("--area", choices=list(attack_blows.AREAS), default="everyday")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--file", type=Path, default=Path("attack.csv"))
    parser.add_argument("--truths", type=Path)
    options = parser.parse_args(arguments)
    truths = attack_blows.Truths(options.truths and options.truths / str(options.seed))
    done = {(x.area, x.number) for x in shared.read_rows(options.file, attack_blows.Verdict)}
    for number in range(options.first, options.first + options.count):
        if (options.area, number) in done:
            continue
        found = list(attack_blows.attack(options.area, number, truths, seed=options.seed))
        shared.write_rows(options.file, found, append=True)
    verdicts = shared.read_rows(options.file, attack_blows.Verdict)
    print(attack_blows.table(verdicts))
    return verdicts


if __name__ == "__main__":
    main()
