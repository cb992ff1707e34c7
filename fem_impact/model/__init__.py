"""The smallest model of a scene's blow that meets its tolerance, and the reasons for that model.

Start with `planner`, which chooses target, modes and time steps. `plan` holds the result in words and numbers, and
`idealisation` the two cheapest models: a rigid body and an infinite plate.
"""
