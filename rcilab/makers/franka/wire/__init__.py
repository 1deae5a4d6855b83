"""The wire of the FCI in its versions 5 (Panda) and 10 (FR3): frames over TCP, states and commands over UDP.

Everything is little-endian and packed. Matrices are column-major.
"""
