"""The Cell tab: obstacles, frames and held part, as the scene shows them and plans are checked with them."""
