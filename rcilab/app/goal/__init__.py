"""The pose that is wanted: asking for it, judging it, planning to it."""
