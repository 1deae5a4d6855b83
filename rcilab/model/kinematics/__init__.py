"""Kinematics of the arm: poses, velocities and inverse kinematics."""
