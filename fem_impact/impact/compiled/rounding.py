"""How far the iterations of the kernels go: to rounding, and no farther."""

SOLVED = 1e-15  # [-] of the largest unknown: what the last iteration of a solved system changes is rounding
STALLED = 1e-11  # [-] of it: a change below this that no longer halves is the rounding of an ill-conditioned system
REPEATED = 4e-16  # [-] of its size: two values so near are one but for rounding, twice that of a number
NEAR = 1e-9  # [-] of an approach or a step: two nearer than this differ by rounding of the forces between them
CHORD = 1e-6  # [-] of two approaches: the chord of a force between nearer ones loses ten digits to rounding; its slope
# errs by that share
ITERATIONS = 64  # [-] at most, of what converges: bisection alone is below rounding after 53
OVERFLOW = 1e300  # [-] beyond it an iteration has diverged: its squares are no numbers
