"""The program of waypoints: editing, checking, planning and saving it."""
