"""Reads boxes of 64 voxels a side by another program. Arguments: zarr or tensorstore, store, file of places (x y z a line), passes,
bytes that may be kept. Prints CPU seconds of a pass, and the sum of all values of one."""

import sys
import time

import numpy as np

kind, store, places, passes, kept = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]), int(sys.argv[5])
boxes = [tuple(map(int, line.split())) for line in open(places)]
if kind == "zarr":
    import zarr

    def opened():
        return zarr.open_array(f"{store}/0", mode="r")

    def read(array, x, y, z):
        return array[z:z + 64, y:y + 64, x:x + 64]
else:
    import tensorstore

    def opened():
        context = tensorstore.Context({"cache_pool": {"total_bytes_limit": kept}})
        spec = {"driver": "zarr3", "kvstore": {"driver": "file", "path": f"{store}/0/"}}
        return tensorstore.open(spec, read=True, context=context).result()

    def read(array, x, y, z):
        return array[z:z + 64, y:y + 64, x:x + 64].read().result()

array = opened()
total = sum(int(np.sum(read(array, *place), dtype=np.uint64)) for place in boxes)
begin = time.process_time()
for _ in range(passes):
    array = opened()
    for place in boxes:
        read(array, *place)
print(f"{(time.process_time() - begin) / passes:.6f}\t{total}")
