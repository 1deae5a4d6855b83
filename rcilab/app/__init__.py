"""From where somebody wants the arm to a judged motion, and what is to be said about it."""
