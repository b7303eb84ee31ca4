#!/usr/bin/env python3
"""Our map and clusters of a take beside MiniSom's algorithm and scikit-learn on the same poses, as a table.

Usage: manifold.py STUDY TAKE [EPOCHS [SIDE]]
    manifold.py build/tests/studies/manifold_study walk_07_01.bvh
STUDY is the program manifold_study; TAKE a clip. 50 epochs of 65 x 65 nodes, as ours; a dance of a thousand frames
takes MiniSom's algorithm two minutes a run, a walk half a minute, and there are twelve runs.
Components, regularisation and covariances of the mixtures are the same on both sides.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
from sklearn.cluster import KMeans
from sklearn.mixture import GaussianMixture

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "manifold"))
from reference_values import errors, minisom  # noqa: E402

SEEDS = 6


def learn(study, take):
    """What manifold_study prints of a take, its poses and their principal coordinates."""
    with tempfile.TemporaryDirectory() as folder:
        files = [f"{folder}/{name}.csv" for name in ("poses", "points")]
        text = subprocess.run([study, take, take, *files], check=True, capture_output=True, text=True).stdout
        return text, *(np.loadtxt(path, delimiter=",") for path in files)


def tell_maps(text, poses, epochs, side):
    """Ours, then MiniSom's own width and decay, a wider one, one of a quarter of the side, and its newer decay, linear
    to 1 and 0."""
    print(f"{'map':44} quantization/m topographic")
    ours = re.search(r"SOM map.*quantization (\S+) m, topographic (\S+),", text)
    print(f"{'ours, 50 epochs':44} {float(ours[1]):14.5f} {float(ours[2]):11.4f}", flush=True)
    for sigma, decay in ((1.0, "asymptotic"), (3.0, "asymptotic"), (side / 4, "asymptotic"), (side / 2, "linear")):
        for seed in (1, 2, 3):
            q, t = errors(minisom(poses, side, epochs, sigma, seed=seed, decay=decay), poses)
            name = f"MiniSom, {epochs} epochs, {sigma:g} {decay}, seed {seed}"
            print(f"{name:44} {q:14.5f} {t:11.4f}", flush=True)


def tell_clusters(text, points):
    clusters = int(re.search(r"; (\d+) primitives", text)[1])
    print(f"{clusters} clusters{'':32} k-means  mixture")
    ours = re.findall(r"^seed (\d+): +k-means (\S+) .*mixture (\S+)$", text, re.MULTILINE)
    for seed, inertia, likelihood in ours:
        print(f"{'ours, seed ' + seed:40} {float(inertia):9.4f} {float(likelihood):8.4f}")
    for seed in range(SEEDS):
        options = dict(random_state=seed, reg_covar=1e-4, tol=1e-6, max_iter=500)
        for count in (1, 10):
            inertia = KMeans(clusters, n_init=count, random_state=seed).fit(points).inertia_
            mixture = GaussianMixture(clusters, n_init=count, **options).fit(points).score(points)
            name = f"scikit-learn, seed {seed}, best of {count}"
            print(f"{name:40} {inertia:9.4f} {mixture:8.4f}", flush=True)


def main():
    study, take = sys.argv[1:3]
    epochs, side = (int(value) for value in (sys.argv[3:] + ["50", "65"][len(sys.argv) - 3:]))
    text, poses, points = learn(study, take)
    print(f"{pathlib.Path(take).stem}: {len(poses)} frames")
    tell_clusters(text, points)
    tell_maps(text, poses, epochs, side)


if __name__ == "__main__":
    main()
