"""Meshes of the cases: recipes, conversion, checks, and the one file format the programs read."""
