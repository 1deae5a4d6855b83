"""The xMate arms, one data file each."""

ROBOTS = {"xMatePro3": "xmate_pro3", "xMatePro7": "xmate_pro7", "xMate3": "xmate3", "xMate7": "xmate7"}
"""The data file in this folder by the name of the arm."""
