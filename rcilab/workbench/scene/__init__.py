"""The 3D scene, and the actions of the mouse in it."""
