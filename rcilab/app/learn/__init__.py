"""The Learn tab: the fault lab, and lessons that watch the learner's actions."""
