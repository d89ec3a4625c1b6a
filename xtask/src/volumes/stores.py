"""Writes the stores that are read: OME-Zarr 0.5 of two levels of a raw volume of 16 bits. Arguments: file, width, height, depth,
directory. Names are CODEC-CHUNK-DTYPE, with the shards' side in chunks behind those that have shards."""

import sys
from pathlib import Path

import numpy as np
import zarr
from zarr.codecs import BloscCodec, ZstdCodec

path, (width, height, depth), directory = sys.argv[1], map(int, sys.argv[2:5]), Path(sys.argv[5])
SHAPE = (256, 384, 384)
values = np.fromfile(path, "<u2").reshape(depth, height, width)[:SHAPE[0], :SHAPE[1], :SHAPE[2]]
axes = [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
scale = [[{"type": "scale", "scale": [side] * 3}] for side in (0.5, 1.0)]
datasets = [{"path": str(n), "coordinateTransformations": scale[n]} for n in (0, 1)]
ome = {"version": "0.5", "multiscales": [{"name": "cells", "axes": axes, "datasets": datasets}]}


def write(name, of, chunk, compressors, shards=None):
    group = zarr.open_group(directory / name, mode="w", zarr_format=3, attributes={"ome": ome})
    for level, data in enumerate([of, of[::2, ::2, ::2]]):
        array = group.create_array(str(level), shape=data.shape, dtype=data.dtype, chunks=(chunk,) * 3, compressors=compressors,
                                   shards=None if shards is None or level else (chunk * shards,) * 3)
        array[...] = data


for width, of in (("u16", values), ("u8", np.minimum(values >> 4, 255).astype("u1"))):
    shuffle = "shuffle" if width == "u16" else "noshuffle"
    for codec, compressors in (("zstd", [ZstdCodec(level=3)]), ("blosc-lz4", [BloscCodec(cname="lz4", clevel=5, shuffle=shuffle)]),
                               ("none", None)):
        for chunk in (64, 32):
            write(f"{codec}-{chunk}-{width}", of, chunk, compressors)
write("zstd-64-u16-shards2", values, 64, [ZstdCodec(level=3)], 2)
(directory / "whole").write_text("all stores are written\n")
