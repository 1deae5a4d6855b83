"""The page: panels, scene and plots in viser, access and controls."""
