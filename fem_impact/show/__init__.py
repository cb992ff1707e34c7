"""Output of all kinds: plots, pictures, sound and files.

Start with `figures`, which sets the style of every plot. `pictures` renders shapes and waves, `sound` computes what a
listener hears, and `export` writes VTK, WAV, JSON and tables.
"""
