"""Output of all kinds: plots, pictures, sound and files.

Start with `figures`, which sets the style of every plot. `pictures` renders shapes and waves, `sound` computes what a
listener hears, and `export` writes VTK, WAV, JSON and tables.
"""

FORMATS = ("png", "pdf", "svg")  # of pictures; what is rendered stays an image within a PDF or SVG file
