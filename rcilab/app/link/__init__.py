"""Links to a view: what they contain, and how they are opened."""
