"""HTML pages: a report of one blow, and a live page whose sliders change the blow.

Start with `report`, which writes one self-contained page. `explore` serves the live page by `explore_server`:
`explore_session` answers its hand, with the words and numbers of `explore_numbers`; `explore_worker` computes beside.
`explore_bench` makes a scene of a dropped drawing, and of names of the catalogue. `html_page` fills the templates.
"""
