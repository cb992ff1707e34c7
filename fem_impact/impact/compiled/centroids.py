"""The mean frequency of a blow's force, from its spectrum."""

import numpy as np

from .build import LOOSE, inner
from .cubics import cubic
from .law import point_at

LANES = 32  # [-] frequencies of a spectrum found together; does not change the result


@inner(allocates=True, fastmath=LOOSE)
def add_spectrum(samples, start, dt, step, out_real, out_imag):
    """Add the sum of samples[k] exp(i omega (start + k dt)) for omega = 0, step, 2 step, ... to a spectrum.

    Goertzel's recursion, LANES frequencies at a time; an even number of steps between the samples.
    """
    work = np.empty((7, LANES))
    c, s, ahead, aside, twice, one, two = work[0], work[1], work[2], work[3], work[4], work[5], work[6]
    c[0] = ahead[0] = 1.0
    s[0] = aside[0] = 0.0
    cosine, sine, along, across = np.cos(step * dt), np.sin(step * dt), np.cos(step * start), np.sin(step * start)
    for i in range(1, LANES):
        c[i] = c[i - 1] * cosine - s[i - 1] * sine
        s[i] = c[i - 1] * sine + s[i - 1] * cosine
        ahead[i] = ahead[i - 1] * along - aside[i - 1] * across
        aside[i] = ahead[i - 1] * across + aside[i - 1] * along
    wide = LANES * step
    cosine, sine, along, across = np.cos(wide * dt), np.sin(wide * dt), np.cos(wide * start), np.sin(wide * start)
    for block in range(0, out_real.size, LANES):
        real, imag = out_real[block : block + LANES], out_imag[block : block + LANES]
        for i in range(LANES):
            twice[i] = 2.0 * c[i]
            one[i] = two[i] = 0.0
        for k in range(samples.size - 1, 0, -2):
            last, before = samples[k], samples[k - 1]
            for i in range(LANES):
                two[i] = last + twice[i] * one[i] - two[i]
                one[i] = before + twice[i] * two[i] - one[i]
        for i in range(LANES):
            x = samples[0] + c[i] * one[i] - two[i]
            y = s[i] * one[i]
            real[i] += ahead[i] * x - aside[i] * y
            imag[i] += ahead[i] * y + aside[i] * x
            old = c[i]
            c[i] = old * cosine - s[i] * sine
            s[i] = old * sine + s[i] * cosine
            old = ahead[i]
            ahead[i] = old * along - aside[i] * across
            aside[i] = old * across + aside[i] * along


@inner(allocates=True)
def centroid(contacts, n_contacts, n_steps, h, ends, rates, spring, limit):
    """Mean frequency of the magnitude of the force spectrum from zero to ``limit``.

    Trapezoidal sums over each contact and over the band, with the Euler-Maclaurin terms for a force that starts with a
    slope and for a magnitude that has one at the band's end. Approaches between steps are cubics. Not a number where
    the sums would take long.
    """
    begun = contacts[0, 0]
    # 16 frequencies over the inverse of the time between first touch and last: errs by 1e-4; test_batches.py
    wanted = min(max(16.0 * limit * (contacts[n_contacts - 1, 1] - begun), 64.0), 65536.0)
    n = LANES * int(np.ceil(wanted / LANES))
    step = 2.0 * np.pi * limit / (n - 1)
    real = np.zeros(n)
    imag = np.zeros(n)
    for contact in range(n_contacts):
        start, end = contacts[contact, 0], contacts[contact, 1]
        # two per step, and 12 per period of the highest frequency: the rule errs by (2 pi / 12)**4 / 720
        samples = max(16.0, 2.0 * (end - start) / h, 12.0 * limit * (end - start))
        if n * samples > 3e8:  # the work; a transform takes it
            return np.nan
        count = 2 * int(np.ceil(0.5 * samples))
        dt = (end - start) / count
        force = np.zeros(count + 1)
        for i in range(1, count):
            t = (start + i * dt) / h
            j = min(int(t), n_steps - 1)
            d, rate = cubic(ends[j], h * rates[j], ends[j + 1], h * rates[j + 1], t - j)
            force[i] = dt * max(0.0, point_at(d, spring).force * (1.0 + spring.loss * rate / h))
        if spring.exponent == 1.0:
            force[0] = force[1] / 12.0
            force[count] = force[count - 1] / 12.0
        add_spectrum(force, start - begun, dt, step, real, imag)
    top = bottom = 0.0
    for i in range(n):
        real[i] = np.sqrt(real[i] ** 2 + imag[i] ** 2)
        top += real[i] * i
        bottom += real[i]
    last, before, earlier = real[n - 1], real[n - 2], real[n - 3]
    top -= 0.5 * last * (n - 1) - real[0] / 12.0
    top -= (1.5 * last * (n - 1) - 2.0 * before * (n - 2) + 0.5 * earlier * (n - 3)) / 12.0
    bottom -= 0.5 * (real[0] + last) + (1.5 * last - 2.0 * before + 0.5 * earlier) / 12.0
    return top / bottom * limit / (n - 1)
