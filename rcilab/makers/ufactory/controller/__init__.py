"""The virtual controller of UFACTORY's arms: their side of the protocol on the neutral virtual arm."""
