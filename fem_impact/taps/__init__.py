"""Measured taps of an instrumented hammer: reading them, what a rig records, and the model that explains them.

Begin with `records` (the table of taps and how it is read), then `rig` (what an analyser makes of a blow), `unknowns`,
`fit` and `found`. `transfer` has frequency responses and the comparison of modes.
"""
