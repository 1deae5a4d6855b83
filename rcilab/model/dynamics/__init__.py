"""Dynamics: the joint torques of a motion."""
