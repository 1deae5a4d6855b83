"""A virtual RCI controller: a pure core that lives one millisecond at a time, and a thin server around it."""
