"""Comparison with other packages on the same arm, in the same process: `rcilab bench compare`."""
