"""Who a boundary particle belongs to: owner numbers, shared by fluid, bodies and couplers."""

WALL = 0  # fixed walls and bathymetry
PISTON = 1  # the wavemaker
FIRST_BODY = 2  # the b-th body is FIRST_BODY + b
