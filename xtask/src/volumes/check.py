"""Reads an OME-Zarr with zarr-python and compares every level with means by NumPy. Arguments: OME-Zarr, then a raw file and its width,
height and depth, or a single OME-Zarr of whose level 0 it was made."""

import sys

import numpy as np
import zarr


def halved(a, axes):
    """Means of boxes along the axes that have more than one value, halves upwards; the last one of an odd axis stands for itself."""
    counts, sums = 1, a.astype(np.int64)
    for axis in axes:
        if sums.shape[axis] == 1:
            continue
        if sums.shape[axis] % 2:
            sums = np.concatenate([sums, sums.take([-1], axis)], axis)
        even, odd = (sums.take(range(n, sums.shape[axis], 2), axis) for n in (0, 1))
        sums, counts = even + odd, counts * 2
    return ((sums + counts // 2) // counts).astype(a.dtype)


def multiscale(group):
    said = dict(group.attrs)
    return said.get("ome", said)["multiscales"][0]


made = zarr.open_group(sys.argv[1], mode="r")
if len(sys.argv) > 3:
    width, height, depth = map(int, sys.argv[3:6])
    expected = np.fromfile(sys.argv[2], "<u2").reshape(depth, height, width)
else:
    source = zarr.open_group(zarr.storage.ZipStore(sys.argv[2], mode="r"), mode="r")
    expected = source[multiscale(source)["datasets"][0]["path"]][...]
datasets = multiscale(made)["datasets"]
for level, dataset in enumerate(datasets):
    if level:
        expected = halved(expected, range(expected.ndim - 3, expected.ndim))
    found = made[dataset["path"]][...]
    if found.dtype != expected.dtype or found.shape != expected.shape or not np.array_equal(found, expected):
        sys.exit(f"{sys.argv[1]}: level {level} of {found.dtype} {found.shape} is not what NumPy makes it: {expected.dtype} {expected.shape}")
print(len(datasets))
