"""Build stiffness and mass matrices from a mesh, a section and supports, and find modes and static deflections.

Start with `assembly`, which builds a `System` by a `Theory`: `kirchhoff` (thin plates on Argyris triangles that follow
the true edge), `thick`, `euler` (beam elements of degree 32) or `shear_beam`. `refinement` finds its lowest modes to a
tolerance, and `point_load` finds its deflection under a point force.
"""
