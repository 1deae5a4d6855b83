"""The session with an arm: connects, reads states, and runs motions and callbacks at 1 kHz."""
