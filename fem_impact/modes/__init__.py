"""`Modes` describes a vibrating body; every later stage works on it alone.

Start with `modal`, which defines `Modes` and computes them by finite elements. `analytic` has closed forms for
rectangles, beams and disks (`timoshenko` stout ones); `ritz` makes vectors that stand for modes in a blow, `air` adds
the air around a plate (`free_air` without a wall), and `universal_files` reads and writes the files of modal testing.
"""
