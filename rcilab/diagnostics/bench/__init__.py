"""How fast this machine runs what a person or a robot waits for, beside what we promise."""
