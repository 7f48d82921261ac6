"""One step of the fluid."""
