"""What h5py (Debian: python3-h5py) reads in an exported recording, for tests to compare with the recording.

    hdf5_witness.py HDF5 OUT   a line for each dataset of numbers in /machine and /operator: path, unit, values by row

Cells are separated by tabs. Exit code 77: h5py is not installed.
"""

import sys

try:
    import h5py
except ImportError:
    sys.exit(77)


def main(arguments):
    with h5py.File(arguments[0], "r") as file, open(arguments[1], "w", encoding="utf-8") as out:
        for group in ("machine", "operator"):
            for name, dataset in file[group].items():
                unit = dataset.attrs.get("unit", b"").decode()
                values = [repr(float(v)) for v in dataset[()].reshape(-1)]
                print(f"{group}/{name}", unit, *values, sep="\t", file=out)
        for name, dataset in file["files"].items():
            print(f"files/{name}", len(dataset[()]), sep="\t", file=out)


main(sys.argv[1:])
