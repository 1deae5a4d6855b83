"""What others offer for the same arm, measured beside our own in the same process: `rcilab bench compare`."""
