"""The RealMan arms, one data file each."""

ROBOTS = {
    "RM65": "rm65",
    "RM75": "rm75",
    "RML63-III": "rml63_iii",
    "ECO65": "eco65",
    "ECO63": "eco63",
    "GEN72": "gen72",
}
"""The data file in this folder by the name of the arm."""
