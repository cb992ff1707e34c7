"""Contact laws, strikers, the time integration of a blow, and its results.

Start with `collision`: `strike` and `collide` take bodies and a tolerance and return a `Response`. `accuracy` predicts
how many modes a blow needs, `threshold` and `spectra` hold the simple theory, and `compiled` holds the inner loops.
"""
