"""Safety box, tool, load and force-control frame: what is wanted, and what the controller has."""
