"""The robot: readiness, execution, pushes, recordings and their exports."""
