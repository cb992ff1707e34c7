"""Exact step of one mode at any damping, and the moments of its impulse response; see `propagation`."""

import numpy as np

from .build import inner


@inner()
def mode_matrix(w, z, h):
    """Exact free motion of one mode: a11, a12, a22 of the state's step, then slow and fast rate and half gap.

    The rates are those of an overdamped mode, zero below; a21 is -w**2 a12.
    """
    x = z * w * h
    if w == 0.0:
        return 1.0, h, 1.0, 0.0, 0.0, 0.0
    if z < 1.0:
        damped = w * np.sqrt((1.0 - z) * (1.0 + z))
        decay = np.exp(-x)
        s = decay * np.sin(damped * h) / damped
        c = decay * np.cos(damped * h)
        return c + z * w * s, s, c - z * w * s, 0.0, 0.0, 0.0
    if z == 1.0:
        decay = np.exp(-x)
        return decay * (1.0 + x), decay * h, decay * (1.0 - x), w, w, 0.0
    root = w * np.sqrt((z - 1.0) * (z + 1.0))
    fast = z * w + root
    slow = w * (w / fast)
    e1 = np.exp(-slow * h)
    s = e1 * (-np.expm1(-2.0 * root * h)) / (2.0 * root)
    return e1 + slow * s, s, np.exp(-fast * h) - slow * s, slow, fast, root


@inner()
def exponential_sums(z, out_sums):
    """phi_k of -z, k = 1 .. out_sums.size, z >= 0: the integrals of (1-r)**(k-1)/(k-1)! exp(-z r) over [0, 1].

    Upwards by recursion while that keeps digits (k <= z), downwards from a power series at the top.
    """
    count = out_sums.size
    upward = min(count, int(min(z, 1e6)))
    inverse = 1.0
    if upward > 0:
        out_sums[0] = -np.expm1(-z) / z
        for k in range(1, upward):
            out_sums[k] = (inverse - out_sums[k - 1]) / z
            inverse /= k + 1.0
    if upward < count:
        term = 1.0
        for k in range(2, count + 1):
            term /= k
        inverse = term * count
        total = 0.0
        for j in range(1, 60):
            total += term
            term *= -z / (count + j)
            if abs(term) < 1e-18 * total:
                break
        out_sums[count - 1] = total
        for k in range(count - 1, upward, -1):
            out_sums[k - 1] = inverse - z * out_sums[k]
            inverse *= k


@inner()
def mode_moments(w, z, h, out_moments, work):
    """Exact step of one mode: a11, a12, a22, and in out_moments the moments of its impulse response g.

    Moment k is ``h**(-k-1)`` times the integral over [0, h] of ``(h-t)**(k-1)/(k-1)! g(t)``, k = 0 being
    g(h)/h. They obey ``th**2 m[k+1] = 1/k! - 2 x m[k] - m[k-1]`` with ``th = w h``, ``x = z th``: upwards while
    k < th, downwards above, from where ``(k+1)! m[k]`` is 1; heavily damped modes take partial fractions.
    """
    count = out_moments.size - 1
    th = w * h
    x = z * th
    a11, a12, a22, slow, fast, root = mode_matrix(w, z, h)
    out_moments[0] = a12 / h
    if z >= 1.2 and fast * h >= 1.0:  # rates so far apart
        exponential_sums(slow * h, work[0])
        exponential_sums(fast * h, work[1])
        for k in range(1, count + 1):
            out_moments[k] = (work[0, k - 1] - work[1, k - 1]) / (2.0 * root * h)
        return a11, a12, a22
    upward = min(count, int(min(th, 1e6)))
    inverse = 1.0
    before = a22
    for k in range(upward):
        if k == 0 and z == 0.0:
            half = np.sin(0.5 * th) / th
            new = 2.0 * half * half
        else:
            new = (inverse - 2.0 * x * out_moments[k] - before) / (th * th)
        before = out_moments[k]
        out_moments[k + 1] = new
        inverse /= k + 1.0
    if upward < count:
        second = third = 1.0  # moments k and k + 1 times (k+1)! and (k+2)!, which for large k they are
        for k in range(count + 11 + int(4.0 * (th + x)), upward + 1, -1):
            part = 1.0 / ((k + 1.0) * (k + 2.0))
            first = 1.0 - part * th * th * third - part * (k + 2.0) * 2.0 * x * second
            third = second
            second = first
            if k <= count + 1:
                out_moments[k - 1] = second
        share = 1.0
        for k in range(count + 1):
            if k > upward:
                out_moments[k] *= share
            share /= k + 2.0
    return a11, a12, a22
