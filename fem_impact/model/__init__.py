"""The smallest model of a blow that meets its tolerance, and the reasons for that model.

Start with `planner`, which asks the descriptions of the target, `by_idealisation`, `by_mixture`, `by_vectors` and
`by_modes`, for the cheapest that will do, strikes it and takes a better one where the errors require that. `budget` is
what they may err. `target` is the struck body before its modes are known. `audit` asks whether the model itself is
right.
"""
