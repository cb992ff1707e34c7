"""Scenes: a TOML file describes a blow and is checked completely before anything is computed.

Start with `scene`. `schema` lists the tables and keys of a file, `sentences` describes a scene in words, and `maps`
computes maps of one.
"""
