"""The compiled inner loops, and the only package that imports numba.

Start with `schemes`, which holds the equations of one step, then `energy`, which follows a blow with them. A kernel
takes numbers, arrays and named tuples of arrays, checks nothing, and works in whatever units it is given.
"""
