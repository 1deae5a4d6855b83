"""Recorded runs: the run as a value, its file, and the export formats."""
