"""Bytes and values of robot protocols; no sockets, no clocks."""
