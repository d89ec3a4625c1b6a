"""ome-zarr-py's pyramid of a raw volume. Arguments: file, width, height, depth, method, number of levels, output."""

import sys

import numpy as np
import zarr
from ome_zarr.format import FormatV05
from ome_zarr.scale import Methods
from ome_zarr.writer import write_image

path, (width, height, depth), method, levels, output = sys.argv[1], map(int, sys.argv[2:5]), sys.argv[5], int(sys.argv[6]), sys.argv[7]
volume = np.memmap(path, "<u2", "r", shape=(depth, height, width))
factors = [{axis: 2**level for axis in "zyx"} for level in range(1, levels)]
group = zarr.open_group(output, mode="w", zarr_format=3)
write_image(volume, group, scale_factors=factors, method=Methods(method), fmt=FormatV05(), axes=["z", "y", "x"],
            storage_options={"chunks": (64, 64, 64), "compressors": [zarr.codecs.ZstdCodec(level=3)]})
