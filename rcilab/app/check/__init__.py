"""The Check tab: rows that lead to their worst moment, the slow-down, the report in sentences."""
