"""A virtual RCI controller: a pure core that advances one cycle at a time, and the RCI server around it."""
