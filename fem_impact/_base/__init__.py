"""Shared tools: input checks, safe file writing, and a separate process for other libraries' file readers.

Nothing here knows what a plate is. Start with `check`, which words every input error. `files` writes a file completely
or not at all. `isolated` runs file readers with limits on time and memory. `remembered` keeps results that
are needed again. `markup` draws tables and small SVG pictures.
"""
