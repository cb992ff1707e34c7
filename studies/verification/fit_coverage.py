"""Do the intervals of `fi.fit` hold the truth as often as they say, and does it name what the data do not determine?

    python studies/verification/fit_coverage.py [--sets 0] [--first 0] [--file fit_coverage.csv] [--out DIR]
    python studies/verification/fit_coverage.py --timed 3

Makes that many sets of taps of a random hammer through a random contact law on a wall, a known plate or a structure of
one unknown mode, measured with 0.5 % of noise at 25.6 or 51.2 kHz (3 to 10 taps), fits each, and appends one line for
each unknown to the file; a set whose records all end within a pulse is refused and named. Then prints what all lines of
the file say and draws fit_coverage.png; without --sets it only does this. What no data can say is known beforehand:
from force alone, a hammer's mass, the stiffness and the loss of a tip on a wall go together, and so do the masses of a
hammer and of an unknown structure.

With --timed it prints instead how long fits of five taps with six unknowns take, the best of that many repetitions.
"""

import sys
import time
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import beta

import fem_impact as fi
from fem_impact.impact.contact import wall_time
from fem_impact.taps.found import Found

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

NOISE = 0.005  # [-] of the peak
LEVEL = 0.9  # [-] of the intervals
WEAK = 0.25  # [-] of its range: an interval by curvature wider than this is not expected to be closed
KINDS = ("wall", "plate", "mode", "mode and hammer")
HIDDEN = {  # what the force alone cannot determine
    "wall": ("contact.stiffness", "contact.loss", "striker.mass"),
    "plate": (),
    "mode": (),
    "mode and hammer": ("contact.stiffness", "contact.loss", "striker.mass", "mode1.mass"),
}
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")
COLUMNS = ("set", "kind", "rate", "taps", "name", "truth", "value", "low", "high", "ends", "hidden", "weak", "seconds")


def random_case(rng: np.random.Generator):
    """Kind, hammer, contact, struck body, strike point, truth and ranges of the unknowns, speeds and rate."""
    kind = str(rng.choice(KINDS))
    rate = float(rng.choice([25600.0, 51200.0]))
    mass = float(np.exp(rng.uniform(np.log(5e-3), np.log(0.5))))
    exponent = float(rng.choice([1.0, 1.5, rng.uniform(1.2, 3.0)]))
    n_taps = int(rng.integers(3, 11))
    speeds = np.exp(rng.uniform(np.log(0.3), np.log(2.0), n_taps))
    duration = float(np.exp(rng.uniform(np.log(8.0), np.log(25.0)))) / rate
    stiffness = 1.0
    for _ in range(3):  # exact at once for power laws: time goes with stiffness**(-1 / (exponent + 1))
        made = float(wall_time(stiffness, exponent, 1.0 / mass, 1.0))
        stiffness *= (made / duration) ** (exponent + 1.0)
    loss = float(rng.choice([0.0, rng.uniform(0.05, 0.5)]))
    truth = {"contact.stiffness": stiffness, "contact.exponent": exponent}
    if loss:
        truth["contact.loss"] = loss
    target, at = fi.Modes.rigid(1e9), None
    if kind == "plate":
        body = mass * float(np.exp(rng.uniform(np.log(2.0), np.log(50.0))))
        first = float(rng.uniform(0.02, 0.4)) / duration
        target = fi.analytic.rectangle(
            0.5, 0.5 * rng.uniform(0.5, 1.0), mass=body, first_frequency=first, n_modes=30, damping_ratio=0.01
        )
        at = tuple(rng.uniform(0.15, 0.45, 2) * [0.5, 0.25])
    elif kind.startswith("mode"):
        frequency, felt = float(rng.uniform(0.3, 2.0)) / duration, mass * float(np.exp(rng.uniform(-1.0, 2.0)))
        truth |= {"mode1.frequency": frequency, "mode1.mass": felt}
        target = fi.Modes.from_arrays(
            [frequency], [[felt**-0.5]], points=[[0.0]], mass=felt, damping_ratio=0.02, complete=True
        )
        at = [0.0]
    if kind != "mode":
        truth["striker.mass"] = mass
    ranges = {}
    for name, value in truth.items():
        if name == "contact.exponent":
            ranges[name] = (0.8, 4.0)
        elif name == "contact.loss":
            ranges[name] = (0.0, 3.0)
        else:
            low, high = 10.0 ** rng.uniform(0.7, 1.5, 2)
            ranges[name] = (value / low, value * high)
    law = fi.Contact.power(stiffness, exponent, loss=loss)
    return kind, rate, fi.Striker.rigid(mass), law, target, at, truth, ranges, speeds


def examine(number: int) -> list[dict]:
    """One set of taps, fitted: a row for each unknown."""
    rng = np.random.default_rng([7, number])
    kind, rate, striker, law, target, at, truth, ranges, speeds = random_case(rng)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        hits = [fi.strike(target, striker, law, at=at, speed=v, tolerance=1e-5, max_impacts=4) for v in speeds]
    taps = [fi.measure(hit, rate=rate, noise=NOISE, rng=rng, onset=rng.uniform() / rate, duration=6e-3) for hit in hits]
    given = {"striker": striker if kind == "mode" else fi.Striker.rigid(0.1), "contact": fi.Contact.power(1.0, 1.5)}
    if kind == "plate":
        given |= {"target": target, "at": at}
    seconds, found = shared.timed(
        lambda: fi.fit(taps, unknown=ranges, rng=number, robust=False, **given), clock=time.perf_counter
    )
    return [row(number, kind, rate, len(taps), name, truth[name], found, seconds) for name in found.names]


def row(number: int, kind: str, rate: float, n_taps: int, name: str, truth: float, found: Found, seconds: float):
    profile = found.profiles[name]
    low, high = profile.interval(LEVEL)
    values = (
        number, kind, rate, n_taps, name, truth, profile.value, low, high, profile.kind, name in HIDDEN[kind],
        weak(found, name), round(seconds, 2),
    )  # fmt: skip
    return dict(zip(COLUMNS, values))


def weak(found: Found, name: str) -> bool:
    """Whether by curvature, too, the interval fills much of the range."""
    jacobian, i = found.best.jacobian, found.names.index(name)
    others = np.delete(jacobian, i, axis=1)
    left = jacobian[:, i] - others @ np.linalg.lstsq(others, jacobian[:, i], rcond=1e-8)[0]
    spread = np.sqrt(found.best.cost / (len(jacobian) - jacobian.shape[1])) / max(np.linalg.norm(left), 1e-300)
    low, high = found.problem.setting.unknown[i].bounds
    return bool(2.0 * 1.645 * spread > WEAK * (high - low))


def five_taps(kind: str):
    """Five taps of a plate or of a structure of one mode, and what fits six unknowns to them."""
    law = fi.Contact.power(3e8, 1.6, loss=0.2)
    ranges = {"contact.stiffness": (1e6, 1e11), "contact.exponent": (1.0, 3.0), "contact.loss": (0.0, 2.0)}
    given = {"contact": fi.Contact.hertz(1e7), "striker": fi.Striker.rigid(0.1)}
    if kind == "plate":  # known, struck at an unknown point
        target = fi.analytic.rectangle(0.5, 0.4, mass=1.5, first_frequency=90.0, n_modes=30, damping_ratio=0.01)
        at, guess = (0.21, 0.13), (0.25, 0.2)
        given |= {"target": target, "at": guess}
        ranges |= {"striker.mass": (0.02, 0.5), "target.x": (0.1, 0.4), "target.y": (0.08, 0.32)}
    else:
        target = fi.Modes.from_arrays(
            [700.0], [[0.8**-0.5]], points=[[0.0]], mass=0.8, damping_ratio=0.03, complete=True
        )
        at = [0.0]
        ranges |= {"mode1.frequency": (200.0, 3e3), "mode1.mass": (0.1, 5.0), "mode1.damping": (0.005, 0.2)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        hits = [fi.strike(target, fi.Striker.rigid(0.1), law, at=at, speed=v) for v in (0.5, 0.7, 1.0, 1.3, 1.6)]
    taps = [fi.measure(hit, rate=25600.0, noise=NOISE, rng=i, duration=8e-3) for i, hit in enumerate(hits)]
    return taps, {"unknown": ranges, **given}


def timed(count: int) -> dict[str, tuple[float, float]]:
    """Seconds of the search and of search and profiles, the least of ``count`` repetitions, printed."""
    found = {}
    for kind in ("plate", "mode"):
        taps, given = five_taps(kind)
        seconds = []
        for _ in range(count):
            start = time.perf_counter()
            made = fi.fit(taps, profiles=False, **given)
            searched = time.perf_counter() - start
            closed = sum(profile.kind == "closed" for profile in made.profiles.values())
            seconds.append((searched, time.perf_counter() - start))
        search, whole = map(min, zip(*seconds))
        found[kind] = search, whole
        print(
            f"{kind}: five taps, {len(made.names)} unknowns ({closed} closed): {search:.2g} s, with profiles "
            f"{whole:.2g} s (one process, best of {count})"
        )
    return found


def read(path: Path) -> list[dict]:
    rows = shared.read_rows(path)
    for each in rows:
        each.update({name: float(each[name]) for name in ("truth", "value", "low", "high", "rate", "seconds")})
        each.update({name: each[name] == "True" for name in ("hidden", "weak")}, set=int(each["set"]))
    return rows


def share(good: int, count: int) -> str:
    """A share in percent, with its 95 % range (Clopper and Pearson)."""
    low = beta.ppf(0.025, good, count - good + 1) if good else 0.0
    high = beta.ppf(0.975, good + 1, count - good) if good < count else 1.0
    return f"{100.0 * good / max(count, 1):.1f} % of {count} ({100 * low:.1f} to {100 * high:.1f})"


def judge(rows: list[dict]) -> dict[str, tuple[int, int]]:
    """How often the intervals hold the truth, what cannot be determined is called so, and what can be is denied."""
    bounded = [each for each in rows if not each["hidden"] and each["ends"] != "open"]
    hidden = [each for each in rows if each["hidden"]]
    plain = [each for each in rows if not each["hidden"] and not each["weak"]]
    held = sum(each["low"] <= each["truth"] <= each["high"] for each in bounded)
    return {
        "90 % intervals that hold the truth": (held, len(bounded)),
        "unidentifiable, called so": (sum(each["ends"] == "open" for each in hidden), len(hidden)),
        "identifiable, called unidentifiable": (sum(each["ends"] == "open" for each in plain), len(plain)),
    }  # fmt: skip


def report(rows: list[dict]) -> str:
    sets = {each["set"]: each["seconds"] for each in rows}
    lines = [f"{len(sets)} sets of taps, {np.median(list(sets.values())):.1f} s each (median)"]
    for name, (good, count) in judge(rows).items():
        lines.append(f"{name}: {share(good, count)}")
    for kind in KINDS:
        found = judge([each for each in rows if each["kind"] == kind])
        lines.append(f"  {kind}: " + ", ".join(f"{name} {share(*pair)}" for name, pair in found.items() if pair[1]))
    for unknown in sorted({each["name"] for each in rows}):
        good, count = judge([each for each in rows if each["name"] == unknown])["90 % intervals that hold the truth"]
        if count:
            lines.append(f"  {unknown}: intervals hold the truth in {share(good, count)}")
    return "\n".join(lines)


def draw(rows: list[dict], path: Path) -> None:
    """Where the truth lies in its interval, for all that is determined; and the three shares."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.8), layout="constrained")
    places = []
    for kind in KINDS:
        bounded = [each for each in rows if each["kind"] == kind and each["ends"] == "closed" and not each["hidden"]]
        ends = [(each["truth"] - each["low"], each["high"] - each["low"]) for each in bounded]
        places.append([above / wide for above, wide in ends if wide > 0.0])
    names = [f"{kind} ({len(where)})" for kind, where in zip(KINDS, places)]
    left.hist(places, bins=np.linspace(-1.0, 2.0, 31), stacked=True, label=names, color=COLOURS)
    left.axvspan(0.0, 1.0, color="#0072B2", alpha=0.08)
    left.set(xlabel="place of the truth in its 90 % interval", ylabel="unknowns")
    left.legend(frameon=False, fontsize=8, loc="upper left")
    found = judge(rows)
    for i, (good, count) in enumerate(found.values()):
        low, high = (
            beta.ppf(0.025, max(good, 1e-9), count - good + 1),
            beta.ppf(0.975, good + 1, max(count - good, 1e-9)),
        )
        right.plot([100 * low, 100 * high], [i, i], color="#0072B2", lw=3)
        right.plot(100 * good / max(count, 1), i, "o", color="#0072B2")
    for i, (low, high) in enumerate(((87, 93), (95, 100), (0, 5))):
        right.fill_betweenx([i - 0.3, i + 0.3], low, high, color="#009E73", alpha=0.2)
    right.set_yticks(range(3), ["intervals hold\nthe truth", "unidentifiable,\ncalled so", "false\nalarms"])
    right.set(xlabel="share [%], with its 95 % range; green: the aim", xlim=(-2, 102))
    right.invert_yaxis()
    shared.save(path, figure, dpi=150)


def main(arguments: list[str] | None = None) -> list[dict]:
    parser = shared.parser(__doc__, shared.PICTURES)
    parser.add_argument("--sets", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--file", type=Path, default=Path(__file__).with_suffix(".csv"))
    parser.add_argument("--timed", type=int, default=0)
    options = parser.parse_args(arguments)
    if options.timed:
        timed(options.timed)
        return []
    for number in range(options.first, options.first + options.sets):
        try:
            rows = examine(number)
        except ValueError as error:  # every record ends within a late second touch
            print(f"set {number} is refused: {error}")
            continue
        shared.write_rows(options.file, rows, append=True)
    rows = read(options.file)
    print(report(rows))
    draw(rows, options.out / "fit_coverage.png")
    return rows


if __name__ == "__main__":
    main()
