"""The application under page and notebook: from a goal to a checked motion, its execution and its messages."""
