"""The list of waypoints: drafting, checking, planning and storing it."""
