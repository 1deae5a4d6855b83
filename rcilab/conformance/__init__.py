"""The conformance engine: checks a motion against the conditions of its robot, as a whole or cycle by cycle."""
