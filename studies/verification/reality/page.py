"""Holds the program against measurements: strikes every experiment, draws its picture and writes the page.

python studies/verification/reality/page.py            all experiments; some minutes
python studies/verification/reality/page.py leeb taps  these only, printed; the page stays as it is
"""

import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of this package
sys.path.append(str(Path(__file__).parents[2]))  # of `shared`
import shared
from reality import copper, kettledrum, leeb, small_ball, spruce, steel_cantilever, taps
from reality.record import Experiment, Verdict, at_first_look, judge

EXPERIMENTS = tuple(each for part in (taps, small_ball, leeb, kettledrum, copper, steel_cantilever, spruce)
                    for each in part.EXPERIMENTS)  # fmt: skip
PAGE = Path(__file__).parent / "README.md"
LINE = 120  # [-] characters
HEAD = """# Held against reality

Measured numbers beside the bands that this program states, written by `python studies/verification/reality/page.py`.

A band holds nine tenths of what such a measurement would have read: the prediction for inputs drawn at random, each as
well as it is known, with the errors of the computation and of the model and the reading error of the measurement. A
point is inside if its band holds the measured number. Only numbers were taken from the sources, each with its place and
licence; nothing was read off a figure. What was assumed or widened after a first look is said with each experiment, and
the points inside are counted without it, too.
"""
NOT_HELD = """## Looked at, but not held

Their numbers could not be read in a text at hand, only abstracts or first pages:

- The sphere on a hinged steel beam of 60 x 27.8 x 780 mm (Adv. Mech. Eng. 2016, 10.1177/1687814016668089 and
  10.1177/1687814016683351). They say that most falls had several contacts; this program has 3 to 12 of them in each of
  256 falls over speeds of 0.2 to 3 m/s and places from a sixth to the middle of the span. The table of durations is
  missing.
- Balls of rubber, tennis balls and marbles on floors (repositories of student experiments): restitution measured, but
  neither ball nor floor is described. A free aluminium plate with holes (github.com/permas4edu/permas4edu,
  ema/examples/006): size and pictures, no frequencies. Bars of rosewood (supermediocre.org): two lengths in one text.
- The drumstick on a drum (A. Wagner, KTH 2006): 3 to 6 ms over all strokes, tensions and places. This program has 6 to
  10 ms for five heads of 14 inches drawn at random; stick, head and tension are not in the abstract.
- Contact times of falling spheres over the thickness of plates (Appl. Sci. 2026, 16, 89), restitution over diameter to
  thickness (Chin. J. Mech. Eng. 2024, 10.1186/s10033-024-01066-w; Mueller 2015; Boettcher 2017; Sondergaard 1990; Zener
  1941; Raman 1920), spheres on free and clamped beams (arXiv 2207.00795) and on a membrane (arXiv 2208.11089), bars of
  xylophones (Chaigne and Doutaut 1997, Rucz 2021), a splash cymbal (Vibration 2024, 7, 146): no number without the
  tables.
"""


def percent(value: float) -> str:
    """A share in percent with two digits."""
    return f"{100.0 * value:.2g} %"


def inside(verdicts: Sequence[Verdict]) -> int:
    """How many points their bands hold."""
    return sum(each.inside for each in verdicts)


def counted(experiment: Experiment, verdicts: Sequence[Verdict], first: Sequence[Verdict]) -> str:
    """The line of an experiment in the table of all."""
    band, own = (sorted(widths)[len(widths) // 2] for widths in ([v.width for v in verdicts],
                                                                  [v.own_width for v in verdicts]))  # fmt: skip
    reasons = list(dict.fromkeys(each.reason or "not found" for each in verdicts if not each.inside))
    said = "; ".join(reasons) or "-"
    link = f"[{experiment.title}](#{experiment.key.replace('_', '-')})"
    told = f"{len(verdicts)} | {inside(verdicts)} | {inside(first)}"
    return f"| {link} | {told} | ± {percent(band)} | ± {percent(own)} | {said} |"


def section(experiment: Experiment, verdicts: Sequence[Verdict]) -> str:
    """What the page says of one experiment."""
    known = "; ".join(f"{name}: {how}" for name, how in experiment.known.items())
    said = [f"{experiment.title}. {experiment.rig[0].upper()}{experiment.rig[1:]}.", f"Source: {experiment.source}. "
            f"Licence: {experiment.licence}.", f"Known: {known}.", f"Left open: {experiment.left_open}."]  # fmt: skip
    if experiment.found:
        said.append(experiment.found)
    rows = ["| | measured | predicted | band of 90 % | |", "|---|---|---|---|---|"]
    rows += [f"| {' | '.join(each.row())} |" for each in verdicts]
    text = "\n\n".join(textwrap.fill(line, LINE, break_long_words=False, break_on_hyphens=False) for line in said)
    picture = f"![{experiment.key}](../../pictures/reality_{experiment.key}.png)"
    return f"## {experiment.key.replace('_', ' ')}\n\n{text}\n\n{picture}\n\n" + "\n".join(rows) + "\n"


def written(judged: Sequence[tuple[Experiment, Sequence[Verdict], Sequence[Verdict]]]) -> str:
    """The whole page."""
    held, first = ([each for told in judged for each in told[i]] for i in (1, 2))
    head = [
        "| experiment | points | inside | at first look | band, median | measurement's own, median | outside because |",
        "|---|---|---|---|---|---|---|",
    ]
    total = (
        f"{inside(held)} of {len(held)} points are inside ({percent(inside(held) / len(held))}); {inside(first)} are "
        f"without what was assumed after a first look ({percent(inside(first) / len(held))})."
    )
    table = "\n".join([*head, *(counted(*each) for each in judged)])
    sections = (section(experiment, verdicts) for experiment, verdicts, _ in judged)
    return "\n".join([HEAD, f"{total}\n\n{table}\n", *sections, NOT_HELD])


def main() -> None:
    """Strike, print, draw and write."""
    wanted = sys.argv[1:]
    judged = []
    for experiment in EXPERIMENTS:
        if not wanted or any(experiment.key.startswith(name) for name in wanted):
            found = judge(experiment)
            judged.append((experiment, found.verdicts, at_first_look(experiment, found.verdicts)))
            print(counted(*judged[-1]), flush=True)
            shared.save(shared.PICTURES / f"reality_{experiment.key}.png", fi.figures.against(found), dpi=100)
    if not wanted:
        PAGE.write_text(written(judged), encoding="utf-8")


if __name__ == "__main__":
    main()
