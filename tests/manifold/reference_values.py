#!/usr/bin/env python3
"""Prints the values that the tests of `manifold` compare with: scikit-learn 1.2's k-means and mixtures, and the
published algorithm of MiniSom 2.3 [github.com/JustGlowing/minisom] run again in numpy.

Samples are given by formulas, so that the C++ side builds the same ones:
    x_dn = sin(0.7 (d + 1) n / 10) + 0.3 cos(1.3 (d + 2) n / 7),   D = 6, N = 150
"""
import numpy as np
from sklearn.cluster import KMeans
from sklearn.mixture import GaussianMixture

n = np.arange(150)[:, None]
d = np.arange(6)[None]
x = np.sin(0.7 * (d + 1) * n / 10) + 0.3 * np.cos(1.3 * (d + 2) * n / 7)


def minisom(x, size, epochs, sigma, rate=0.5, seed=1, decay="asymptotic"):
    """train_random: a sample a step, Gaussian neighbourhood, rate and sigma over 1 + t / (T / 2), or
    linear to 0 and to 1; begun by pca_weights_init."""
    rng = np.random.RandomState(seed)
    steps = epochs * len(x)
    values, vectors = np.linalg.eigh(np.cov(x.T))
    order = np.argsort(-values)
    grid = np.linspace(-1, 1, size)
    w = grid[:, None, None] * vectors[:, order[0]] + grid[None, :, None] * vectors[:, order[1]]
    k = np.arange(size)
    for t in range(steps):
        difference = w - x[rng.randint(len(x))]
        a, b = np.unravel_index(np.einsum("ijk,ijk->ij", difference, difference).argmin(), (size, size))
        fall = 1 + t / (steps / 2)
        width, pull = sigma / fall, rate / fall
        if decay == "linear":
            width, pull = sigma + (1 - sigma) * t / steps, rate * (1 - t / steps)
        h = np.outer(np.exp(-((k - a) ** 2) / (2 * width**2)), np.exp(-((k - b) ** 2) / (2 * width**2)))
        w -= pull * h[..., None] * difference
    return w.reshape(size * size, -1)


def errors(w, x):
    size = int(np.sqrt(len(w)))
    squared = (w**2).sum(1)[None] - 2 * x @ w.T
    best = np.argsort(squared, axis=1, kind="stable")[:, :2]
    places = np.stack(np.divmod(best, size), -1)
    apart = np.abs(places[:, 0] - places[:, 1]).max(1)
    return np.linalg.norm(x - w[best[:, 0]], axis=1).mean(), (apart > 1).mean()


if __name__ == "__main__":
    for sigma in (1.0, 3.0):
        print("minisom 24 x 24, 30 epochs, sigma %g: quantization %.6f topographic %.6f"
              % (sigma, *errors(minisom(x, 24, 30, sigma), x)))
    for k in (3, 8):
        print(f"k-means {k}: inertia {KMeans(k, n_init=100, random_state=0, tol=0).fit(x).inertia_:.10f}")
    mixture = GaussianMixture(3, n_init=10, random_state=0, tol=1e-9, max_iter=5000).fit(x[:, :2])
    print(f"mixture of 3 on the first two rows: mean log-likelihood {mixture.score(x[:, :2]):.10f}")
    one = GaussianMixture(1, tol=1e-9).fit(x[:, :2])
    print(f"mixture of 1: mean log-likelihood {one.score(x[:, :2]):.10f}")
