"""Numbers of the laws of viscosity: what a scene chooses and the compiled sums read."""

CROSS, HERSCHEL_BULKLEY, GRANULAR = 0, 1, 2
