"""Whether a machine is fit to plan, to simulate and to stream at 1 kHz: one question a finding, with the remedy."""
