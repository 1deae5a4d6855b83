"""The wire of UFACTORY's controllers: the private protocol and standard Modbus on one TCP port, and the report ports.

Header and integers are big-endian, floats little-endian, unless a layout has another order. Lengths are millimetres,
angles radians; orientations are roll, pitch and yaw about fixed axes, or rotation vectors.
"""
