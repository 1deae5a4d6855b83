"""The Learn tab: the fault gallery, and lessons that watch what is done."""
