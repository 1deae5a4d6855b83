"""What became of a motion: the run as a value, its file, and every form in which people take it away."""
