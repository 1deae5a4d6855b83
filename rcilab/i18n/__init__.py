"""Texts, units and number input that the page, the notebook and the command line share."""
