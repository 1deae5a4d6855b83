"""The target pose: posing it, checking it, planning to it."""
