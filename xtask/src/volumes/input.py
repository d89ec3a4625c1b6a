"""Makes a volume for the benchmark: blobs of many sizes and noise, of 16 bits, one raw run. Arguments: file, width, height, depth."""

import sys
from pathlib import Path

import numpy as np

path, (width, height, depth) = Path(sys.argv[1]), map(int, sys.argv[2:5])
rng = np.random.default_rng(7)
y, x = np.mgrid[0:height, 0:width].astype(np.float32)
spots = rng.uniform(0, 1, (60, 5)) * [width, height, depth, 1, 1]
with open(path, "wb") as out:
    for z in range(depth):
        plane = np.full((height, width), 100, np.float32)
        for at_x, at_y, at_z, bright, size in spots:
            radius = 8 + 40 * size
            away = (x - at_x) ** 2 + (y - at_y) ** 2 + (z - at_z) ** 2
            plane += 3000 * (0.2 + bright) * np.exp(-away / (2 * radius * radius), dtype=np.float32)
        plane = rng.poisson(plane)
        np.minimum(plane, 65535).astype("<u2").tofile(out)
Path(f"{path}.toml").write_text(
    f'width = {width}\nheight = {height}\ndepth = {depth}\nsample = "u16"\nscale = [0.5, 0.5, 0.5]\nunit = "micrometer"\n')
