"""Benchmarks of the operations that a user or a robot waits for, with targets."""
