"""One file a contact law: its equations, its numbers and words, and what kernels need of it; `law` lists them all.

`base` says what a law must state; `power` is the shortest example and what the others are made of.
"""
