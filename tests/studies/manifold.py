#!/usr/bin/env python3
"""MiniSom's algorithm and scikit-learn on what manifold_study wrote: beside our figures.

Usage: manifold.py POSES.csv POINTS.csv PRIMITIVES [EPOCHS [SIDE]]
"""
import pathlib
import sys

import numpy as np
from sklearn.cluster import KMeans
from sklearn.mixture import GaussianMixture

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "manifold"))
from reference_values import errors, minisom  # noqa: E402


def main():
    poses, points = (np.loadtxt(path, delimiter=",") for path in sys.argv[1:3])
    clusters = int(sys.argv[3])
    epochs, side = (int(value) for value in (sys.argv[4:] + ["50", "65"][len(sys.argv) - 4:]))
    for sigma in (1.0,):
        print(f"MiniSom {side} x {side}, {epochs} epochs, sigma {sigma:g}: quantization %.4f m, topographic %.3f"
              % errors(minisom(poses, side, epochs, sigma), poses), flush=True)
    print(f"k-means {clusters}, best of 10: %.4f" % KMeans(clusters, n_init=10, random_state=0).fit(points).inertia_)
    mixture = GaussianMixture(clusters, n_init=1, random_state=0, reg_covar=1e-4, tol=1e-6, max_iter=500).fit(points)
    print(f"mixture of {clusters}: %.4f" % mixture.score(points))


if __name__ == "__main__":
    main()
