"""The peak signal-to-noise ratio in dB of pictures beside the first one, each as .npy of 8 bits; infinite where they are the same."""

import sys

import numpy as np

first, *others = (np.load(path).astype(np.float64) for path in sys.argv[1:])
for other in others:
    error = np.mean((first - other) ** 2)
    print("inf" if error == 0 else round(10 * np.log10(255**2 / error), 2))
