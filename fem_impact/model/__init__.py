"""The smallest model of a blow that meets its tolerance, and the reasons for that model.

Start with `planner`, which chooses target, modes and time steps. `target` is the struck body before its modes are
known, and `idealisation` has the two cheapest models: a rigid body and an infinite plate. `audit` asks whether
the model itself is right.
"""
