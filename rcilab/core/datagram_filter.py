"""Which senders' datagrams the kernel keeps for a UDP socket: a flood of others would leave no room for theirs.

Filters of classic BPF, struct sock_filter and sock_fprog; no privilege is needed.
"""

from __future__ import annotations

import ctypes
import socket
import struct
from collections.abc import Collection
from contextlib import suppress

_ATTACH, _DETACH = 26, 27  # SO_ATTACH_FILTER, SO_DETACH_FILTER; `socket` has no names for them.
_LOAD, _JUMP_IF_EQUAL, _RETURN = 0x20, 0x15, 0x06  # BPF_LD | BPF_W | BPF_ABS, BPF_JMP | BPF_JEQ, BPF_RET
_SOURCE = (-0x100000 + 12) & 0xFFFFFFFF  # SKF_NET_OFF: an offset in the IPv4 header.
_WHOLE = 0xFFFFFFFF


def keep_senders(udp: socket.socket, hosts: Collection[str]) -> None:
    """Has the kernel drop datagrams from all but these IPv4 addresses; nothing changes where it grants no filter."""
    program = [(_LOAD, 0, 0, _SOURCE)]
    for left, host in enumerate(hosts):
        address = int.from_bytes(socket.inet_aton(host), "big")
        program.append((_JUMP_IF_EQUAL, len(hosts) - left, 0, address))
    program += [(_RETURN, 0, 0, 0), (_RETURN, 0, 0, _WHOLE)]
    steps = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *step) for step in program))
    with suppress(OSError):
        udp.setsockopt(socket.SOL_SOCKET, _ATTACH, struct.pack("HP", len(program), ctypes.addressof(steps)))


def keep_all_senders(udp: socket.socket) -> None:
    """Takes back what `keep_senders` did, if anything."""
    with suppress(OSError):
        udp.setsockopt(socket.SOL_SOCKET, _DETACH, 0)
