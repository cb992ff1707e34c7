"""Turned round: what makes a blow or a body come out as wanted.

Start with `search` (the search itself and what it finds). `goals` has what can be wanted, and `objects` what is
designed: bodies and blows made from numbers, and how they change with these.
"""
