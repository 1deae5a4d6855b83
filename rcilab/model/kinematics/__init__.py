"""Geometry of the arm: where the tool is, how it moves, and which joint angles put it there."""
