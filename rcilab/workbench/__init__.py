"""The page: panels, scene and plots in viser, who may open it and who holds the controls."""
