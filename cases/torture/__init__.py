"""Does a run survive what a cluster, a laptop or a colleague does to it? `python -m cases.torture`."""
