#!/usr/bin/env python3
"""Prints the scikit-learn values that the tests of `learn` compare with (scikit-learn 1.2, numpy).

Samples and targets are given by formulas, so that the C++ side builds the same ones:
    x_dn = sin(0.7 (d + 1) (n + 1)) + 0.1 d,   y_n = sin(2 x_0n) + 0.5 x_1n x_2n + 0.3 cos(5 n)
for D = 3 features (d) and N = 24 samples (n); queries are the next 4 columns.
Gaussian width w is scikit-learn's gamma = 1 / (2 w^2); U is 1 / alpha.
"""
import numpy as np
from sklearn.decomposition import PCA
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import Ridge
from sklearn.svm import SVR

n = np.arange(28)
d = np.arange(3)[:, None]
x = np.sin(0.7 * (d + 1) * (n + 1)) + 0.1 * d
y = np.sin(2 * x[0]) + 0.5 * x[1] * x[2] + 0.3 * np.cos(5 * n)
train, query = x[:, :24].T, x[:, 24:].T
target = y[:24]


def show(name, values):
    print(name, "{" + ", ".join(f"{v:.15g}" for v in np.ravel(values)) + "}")


linear = Ridge(alpha=1 / 4.0, solver="cholesky").fit(train, target)
show("linear ridge, U = 4: weights, intercept", np.append(linear.coef_, linear.intercept_))

width = 0.8
machine = KernelRidge(alpha=1 / 20.0, kernel="rbf", gamma=1 / (2 * width**2))
machine.fit(train, target - target.mean())
show("kernel ridge, width 0.8, U = 20: queries", machine.predict(query) + target.mean())

svr = SVR(kernel="rbf", gamma=1 / (2 * width**2), C=3.0, epsilon=0.1, tol=1e-8)
svr.fit(train, target)
show("svr, width 0.8, C = 3, epsilon = 0.1: queries", svr.predict(query))
print("svr: support vectors", len(svr.support_))

pca = PCA(n_components=2).fit(train)
show("pca: variances", pca.explained_variance_)
basis = pca.components_
basis *= np.sign(basis[np.arange(2), np.abs(basis).argmax(axis=1)])[:, None]
show("pca: basis, component by component", basis)
