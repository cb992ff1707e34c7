"""HTML pages: a report of one blow, and a live page whose sliders change the blow.

Start with `report`, which writes one self-contained page. `explore` serves the live page, `explore_model`
computes its contents and `explore_view` lays it out.
"""
