"""Jogging: sliders, held buttons, steps and named poses, in the preview and on the robot."""
