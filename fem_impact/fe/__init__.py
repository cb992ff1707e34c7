"""Build stiffness and mass matrices from a mesh, a section and supports, and find modes and static deflections.

Plates are Kirchhoff plates on Argyris triangles that follow the true edge; beam elements have degree 32.
Start with `assembly`, which builds a `System`; `refinement` finds its lowest modes to a tolerance, and `point_load`
finds its deflection under a point force.
"""
