"""RealMan's JSON protocol: one object a line, ended by CR LF in both directions. All numbers are scaled integers."""
