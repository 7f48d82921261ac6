"""A survey to try the scene with: a bed that rises from 6 m under the sea to 2 m under it, as GeoTIFF, heights over a datum."""

import numpy as np
import rasterio
from rasterio.transform import from_origin

CELL, WEST, NORTH, LEVEL = 1.0, 432100.0, 5310300.0, 1.2  # m; mean sea level is 1.2 m over the datum

x = WEST + CELL * (np.arange(200) + 0.5)
heights = np.interp(x, [WEST + 40.0, WEST + 90.0], [-6.0, -2.5]) + LEVEL
grid = np.tile(heights, (100, 1)).astype("float32")
place = {"crs": "EPSG:25832", "transform": from_origin(WEST, NORTH, CELL, CELL)}
with rasterio.open("bed.tif", "w", driver="GTiff", width=200, height=100, count=1, dtype="float32", **place) as file:
    file.write(grid, 1)
