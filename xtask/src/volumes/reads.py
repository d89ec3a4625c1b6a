"""Reads boxes of 64 voxels a side by another program. Arguments: zarr or tensorstore, store, file of places (x y z a line), passes,
bytes that may be kept. Prints CPU seconds of a pass, and the sum of all values of one. With decode for a program all chunks are decoded by the
C libraries that zarr-python calls, from memory into memory, and nothing else is done: of the same chunks that lie in no shards, where the
store has shards."""

import sys
import time
from pathlib import Path

import numpy as np

kind, store, places, passes, kept = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]), int(sys.argv[5])
boxes = [tuple(map(int, line.split())) for line in open(places)]
if kind == "decode":
    from numcodecs import blosc, zstd

    blosc.set_nthreads(1)
    decoder = blosc if "blosc" in store else zstd
    stored = [path.read_bytes() for path in Path(store.split("-shards")[0], "0/c").rglob("*") if path.is_file()]
    output = np.empty(len(decoder.decompress(stored[0])), "u1")
    begin = time.process_time()
    for _ in range(passes):
        for chunk in stored:
            decoder.decompress(chunk, output)
    print(f"{(time.process_time() - begin) / passes:.6f}\t0")
    sys.exit()
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
