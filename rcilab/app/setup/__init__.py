"""Safety box, tool, load and force-control frame: as set on the page, and as the controller has them."""
