"""What the 3D scene draws, and what is done with the mouse in it."""
