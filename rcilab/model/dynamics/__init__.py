"""Forces: what torques a motion takes."""
