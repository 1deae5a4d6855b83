"""The Check tab: rows that lead to their moment, the slow-down, the report in words."""
