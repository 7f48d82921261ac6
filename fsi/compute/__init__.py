"""Numbers in bulk: vector lanes, compiled kernels and the threads that run them; nothing here knows of fluids."""
