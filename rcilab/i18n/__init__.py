"""What page and notebook say in the same words, and how they read what people type."""
