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
    # MiniSom's own width and decay, a wider one, one of a quarter of the side, and its newer decay, linear to 1 and 0.
    for sigma, decay in ((1.0, "asymptotic"), (3.0, "asymptotic"), (side / 4, "asymptotic"), (side / 2, "linear")):
        for seed in (1, 2, 3):
            q, t = errors(minisom(poses, side, epochs, sigma, seed=seed, decay=decay), poses)
            print(f"MiniSom {side} x {side}, {epochs} epochs, sigma {sigma:g}, {decay}, seed {seed}: "
                  f"quantization {q:.4f} m, topographic {t:.4f}", flush=True)
    for seed in range(6):
        kmeans = KMeans(clusters, n_init=10, random_state=seed).fit(points)
        options = dict(random_state=seed, reg_covar=1e-4, tol=1e-6, max_iter=500)
        one, ten = (GaussianMixture(clusters, n_init=n, **options).fit(points).score(points) for n in (1, 10))
        print(f"seed {seed}: k-means {clusters}, best of 10: {kmeans.inertia_:.4f}; "
              f"mixture {one:.4f}, best of 10 {ten:.4f}", flush=True)


if __name__ == "__main__":
    main()
