"""Exact answers and theories that cases are compared with."""
