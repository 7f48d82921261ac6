"""Cases of the fluid alone."""
