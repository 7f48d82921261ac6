"""The benchmark behind `fsi bench`: speed, memory, limits of the machine, cost of each term, start-up.

Each module measures one thing and returns plain rows (dicts with units in their keys); `targets` holds what is wanted,
`report` shows the rows, `run` does all of it in order. Figures of one thread are processor time, those of several threads
wall time; repeats of what is compared are interleaved and medians are taken, because others may use the machine too.
"""
