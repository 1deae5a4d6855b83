"""Drawing of arms, configurations and plots, independent of the library that displays them."""
