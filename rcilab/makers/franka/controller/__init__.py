"""The virtual controller of the Franka arms: their side of the FCI on the neutral virtual arm."""
