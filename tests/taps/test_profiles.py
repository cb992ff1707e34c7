"""Profiles of the likelihood and the scatter over taps, on problems whose answer is known."""

import numpy as np
import pytest
from scipy.stats import t

import fem_impact as fi
from fem_impact.taps import profiles
from fem_impact.taps.solver import Solution, solve
from fem_impact.taps.unknowns import Unknown

FREEDOM = 200
END = float(t.ppf(0.5 + 0.5 * profiles.SURE, FREEDOM))  # root of the rise to which profiles are followed


class Known:
    """Residuals of three unknowns: a function of the first, the second, which goes along with it, and the third."""

    needless, n_shared = (), 3

    def __init__(self, root, low=-10.0, high=10.0, partner=(-1e6, 1e6)):
        self.root, self.free = root, (Unknown("a", low, high), Unknown("b", *partner), Unknown("c", -1.0, 1.0))
        self.bounds = tuple(np.array(ends, float) for ends in zip(*(each.bounds for each in self.free)))

    def residual(self, x):
        a, b, c = (float(each.outside(part)) for each, part in zip(self.free, x))
        return np.append(self.root(a), [50.0 * (b - 2.0 * a), c])

    def jacobian(self, x, held=()):
        steps = 1e-7 * np.eye(3)
        slopes = [(self.residual(x + step) - self.residual(x - step)) / 2e-7 for step in steps]
        return np.delete(np.transpose(slopes), list(held), axis=1)

    def values(self, x):
        return {each.name: float(each.outside(part)) for each, part in zip(self.free, x)}

    def speeds(self, x):
        return np.zeros(0)

    def profile(self, best=0.0):
        """Of the first unknown, whose best fit is known."""
        x = np.array([float(each.inside(value)) for each, value in zip(self.free, (best, 2.0 * best, 0.0))])
        start = Solution(x, float(np.square(self.residual(x)).sum()), self.jacobian(x))
        return profiles.follow_profile(self, start, 0, 1.0, FREEDOM, "a")[0]


def parabola(open_=(False, False), log=False, n=41, width=0.1):
    """The profile of a value 2 with a Gaussian likelihood of the given width."""
    values = np.linspace(1.0, 3.0, n)
    rise = ((values - 2.0) / width) ** 2
    return profiles.Profile("a", 2.0, values, rise, open_, ("", ""), {"b": values**-1.5}, 100, 1.0, 3.0, log)


def test_the_interval_of_a_gaussian_is_students():
    for level in (0.5, 0.9, 0.95):
        half = 0.1 * t.ppf(0.5 + 0.5 * level, 100)
        assert np.allclose(parabola().interval(level), [2.0 - half, 2.0 + half], rtol=1e-4)


def test_a_best_fit_at_the_end_of_its_range_is_followed_one_way_only():
    profile = Known(lambda a: 2.0 + a, low=-1.0).profile(-1.0)
    assert profile.values.min() == -1.0 < profile.interval()[1] < 10.0 and profile.open == (True, False)


def test_open_ends_are_the_ends_of_the_range():
    flat = parabola(open_=(True, True), width=100.0)
    assert flat.interval() == (1.0, 3.0) and flat.kind == "open"
    assert parabola().kind == "closed" and parabola(open_=(False, True)).kind == "limited"


def test_white_residuals_are_white_and_coloured_or_ringing_ones_are_not():
    rng = np.random.default_rng(3)
    white = rng.standard_normal((5, 60))
    noise, freedom, chance = profiles.variance(white, 10)
    assert abs(noise - 1.0) < 0.2 and freedom == 290 and chance > profiles.DOUBTED
    coloured = np.array([np.convolve(row, np.ones(4), mode="same") for row in white])
    wider, fewer, chance = profiles.variance(coloured, 10)
    assert chance < 1e-6 and fewer < 150 and wider > 2.5 * np.mean(coloured**2)
    noise = rng.standard_normal((8, 200))
    assert profiles.variance(noise[:, 8:] + 0.3 * noise[:, :-8], 3)[2] < profiles.DOUBTED  # an echo after eight samples


@pytest.mark.parametrize("bend", [0.05, 0.2, 0.3, 0.45])
def test_ends_of_a_bent_likelihood_are_exact_to_a_thirtieth(bend):
    """The root of the rise is (exp(bend x) - 1) / bend; of three points to a side at least its ends are read."""
    made = Known(lambda a: np.expm1(bend * 100.0 * a) / bend).profile()
    for level in (0.5, 0.9, profiles.SURE):
        reached = t.ppf(0.5 + 0.5 * level, FREEDOM)
        ends = np.array([np.log1p(sign * bend * reached) / bend / 100.0 for sign in (-1.0, 1.0)])
        assert np.allclose(made.interval(level), ends, rtol=0.03)  # 0.027 was measured


@pytest.mark.parametrize("decades", [2, 5])
def test_a_limit_far_beyond_the_curvature_is_found(decades):
    """The rise slows down at once, by its logarithm, and still ends a profile at one, where the data set a limit."""
    near = 10.0**-decades
    made = Known(lambda a: END * np.sign(a) * np.log1p(abs(a) / near) / np.log1p(1.0 / near)).profile()
    assert made.open == (False, False) and np.allclose(made.interval(profiles.SURE), (-1.0, 1.0), rtol=5e-3)


def test_a_profile_does_not_step_over_values_that_the_data_refuse():
    """A quarter of the range is refused, a little away from a best fit beside which hardly anything changes."""
    made = Known(lambda a: [0.001 * a, 4.0 * END * np.exp(-(((a - 10.0) / 4.0) ** 2))], high=30.0).profile()
    first = 10.0 - 4.0 * np.sqrt(np.log(4.0))  # where the rise first reaches the end
    assert made.open == (True, False) and made.interval(profiles.SURE)[1] == pytest.approx(first, rel=0.05)


def test_a_profile_whose_rise_stalls_does_not_leap_over_a_bend():
    """After a first step of 4, with the rise at a fifth, secants would lead beyond the bend from 12 to 18."""
    stalls = Known(lambda a: [0.2 * END * np.tanh(a), 3.0 * END * np.exp(-(((a - 15.0) / 2.5) ** 2))], -100.0, 100.0)
    found = stalls.profile().interval(profiles.SURE)[1]
    assert found == pytest.approx(15.0 - 2.5 * np.sqrt(np.log(3.0)), rel=0.05)


def test_another_unknown_at_its_bound_is_named_where_it_ends_the_profile():
    """The second unknown would go along to 20 but ends at 12."""
    made = Known(lambda a: 1e-3 * a, partner=(-60.0, 12.0)).profile()
    assert made.held_by[1] == "b" and made.held_by[0] == ""


def test_an_interval_open_at_one_end_and_wide_tells_nothing():
    values = np.linspace(1.0, 3.0, 201)
    for width, kind in ((0.7, "open"), (0.3, "limited")):
        rise = 100.0 * (values < 1.0 + 2.0 * (1.0 - width))  # closed at this place of the range from 1 to 3
        assert profiles.Profile("a", 3.0, values, rise, (False, True), ("", ""), {}, 99, 1.0, 3.0, False).kind == kind


def test_the_ridge_of_a_flat_profile_is_the_power_of_those_that_move_by_some_per_cent_for_twice_the_value():
    assert parabola(open_=(True, True), log=True, width=100.0).ridge == pytest.approx({"b": -1.5})
    values = np.linspace(1.0, 3.0, 41)
    others = {"seen": values**0.08, "still": values**-0.03}
    flat = profiles.Profile("a", 2.0, values, 0.0 * values, (True, True), ("", ""), others, 100, 1.0, 3.0, True)
    assert list(flat.ridge) == ["seen"]


def test_one_white_record_of_a_hundred_is_doubted():
    """The variance then grows by the sum of an autocorrelation that is none."""
    rng = np.random.default_rng(5)
    rows = (rng.standard_normal((2, 100)) for _ in range(400))
    grown = [abs(profiles.variance(row, 0)[0] / np.square(row).mean() - 1.0) > 1e-12 for row in rows]
    assert sum(grown) <= 12  # 4 +- 2 are expected


class Straight:
    """A linear problem: each tap measures its own value 50 times, besides a momentum and an onset that matter not."""

    def __init__(self, n_taps):
        self.free, self.owners, self.n_shared = (Unknown("a", 1.0, 10.0),), ["a"], 1
        self.data = type("Data", (), {"n_taps": n_taps})

    def jacobian(self, x):
        n = self.data.n_taps
        out = np.zeros((n, 50, 1 + 3 * n))
        out[:, :, 0] = 1.0
        for tap in range(n):
            out[tap, :, 1 + 2 * n + tap] += 1.0
            out[:, :, 1 + 2 * n + tap] -= 1.0 / n
        return out.reshape(-1, 1 + 3 * n)

    def apart(self, x):
        far = x[None, 1 + 2 * self.data.n_taps :]
        return far - far.mean()

    def values(self, x, tap=None):
        return {"a": float(np.exp(x[0] + (0.0 if tap is None else self.apart(x)[0, tap])))}


def test_noise_makes_the_spread_of_independent_means():
    problem, noise = Straight(5), 0.04
    apart = [0.1, -0.1, 0.2, 0.0, 0.3]
    made = profiles.scatter(problem, np.concatenate([[np.log(2.0)], np.zeros(10), apart]), 0, noise, 200)
    assert made.by_noise == pytest.approx(np.sqrt(noise / 50), rel=1e-9)  # standard error of a mean of 50
    assert made.deviation == pytest.approx(np.std(apart, ddof=1)) and made.mean == 2.0 and made.chance < 1e-3
    none = profiles.Scatter("a", np.ones(5), 1.0, 0.1, 0.1, True, 200)  # a spread as noise makes it
    assert none.chance == pytest.approx(0.41, abs=0.01)  # F(1; 4, 200)


@pytest.mark.slow
def test_no_other_search_ends_below_a_point_of_a_profile(monkeypatch):
    """A hammer on a body of one mode of low damping, whose profiles end at sides of the ranges: searches that stay away
    from the sides stop up to a hundred times the noise too high.

    Up to where profiles end, a fresh search of 300 steps may gain what `solver.NEARLY` leaves, several times over
    along a valley.
    """
    k, mass, f = 5.9e6, 0.104, 815.0
    known = {"points": [[0.0]], "mass": 0.67, "damping_ratio": 0.007, "complete": True, "free": False}
    body = fi.Modes.from_arrays([f], [[0.67**-0.5]], **known)
    hammer, law = fi.Striker.rigid(mass), fi.Contact.linear(k, loss=0.8)
    hits = [fi.strike(body, hammer, law, at=[0.0], speed=v) for v in (0.6, 1.4)]
    taps = [fi.measure(hit, rate=48000.0, noise=5e-3, rng=i, duration=0.01) for i, hit in enumerate(hits)]
    ends, search = [], profiles._Climb._solve

    def kept(climb, start, held):
        ends.append((climb.problem, search(climb, start, held), held))
        return ends[-1][1]

    monkeypatch.setattr(profiles._Climb, "_solve", kept)
    truth = dict(zip(("contact.stiffness", "contact.loss", "mode1.frequency", "mode1.mass", "mode1.damping"),
                     (k, 0.8, f, 0.67, 7e-3)))  # fmt: skip
    found = fi.fit(taps, striker=hammer, contact=law, starts=3, unknown={
        "contact.stiffness": (1e5, 1e9), "contact.loss": (0.0, 5.0), "mode1.frequency": (270.0, 2400.0),
        "mode1.mass": (0.067, 6.7), "mode1.damping": (0.0, 0.3),
    })  # fmt: skip
    assert all(low <= truth[name] <= high for name, (low, high) in ((name, found.interval(name)) for name in truth))
    noise = found._noise[0]
    near = [each for each in ends if each[1].cost - found.best.cost < 10.0 * noise]
    gains = [(one.cost - solve(problem, one.x, 300, 1e-4, held).cost) / noise for problem, one, held in near]
    assert len(gains) > 20 and max(gains) < 0.3
