"""Many blows at once: maps over striker mass, stiffness, speed and other parameters.

Start with `grid`, which builds and computes a map. `batches` computes many blows together, `store` saves long maps so
that they can be resumed, and `hammers` uses maps to choose a hammer.
"""
