"""The virtual controller of the RealMan arms: their side of the JSON protocol on the neutral virtual arm."""
