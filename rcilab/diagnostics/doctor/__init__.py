"""Checks whether a machine can plan, simulate and stream at 1 kHz, with remedies."""
