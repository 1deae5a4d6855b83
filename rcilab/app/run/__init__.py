"""What happens on the robot: readiness, execution, pushes, recordings and their exports."""
