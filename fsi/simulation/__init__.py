"""The run: the loop, what moves in it, and what is kept of it."""
