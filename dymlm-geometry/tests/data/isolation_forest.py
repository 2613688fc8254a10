"""Prints scikit-learn's figures for tests/it/isolation_forest.rs: python3 isolation_forest.py FOLDER_OF_OUTLIERS

scikit-learn 1.9.1; ROC-AUC of 100 trees on 256 rows, mean and standard deviation over 100 seeds.
"""

import sys
import warnings
from pathlib import Path

import numpy as np
from sklearn.ensemble import IsolationForest
from sklearn.metrics import roc_auc_score


def synthetic():
    """1000 rows of 4 columns; the first 100 are spread wider. The generator is that of the test."""
    state, rows = 12345, []
    for row in range(1000):
        numbers = []
        for _ in range(16):
            state = (state * 1103515245 + 12345) % 2**31
            numbers.append(state / 2**31)
        sums = np.array(numbers).reshape(4, 4).sum(axis=1) - 2
        rows.append(sums * (2 if row < 100 else 1))
    return np.array(rows, dtype=np.float32), np.arange(1000) < 100


def recorded(folder, name):
    table = np.loadtxt(folder / f"{name}.csv", delimiter=",", skiprows=1)
    return table[:, :-1].astype(np.float32), table[:, -1]


warnings.simplefilter("ignore")  # glass has fewer than 256 rows: all are taken
sets = {"synthetic": synthetic()}
for name in ["cardio", "glass", "wbc"]:
    sets[name] = recorded(Path(sys.argv[1]), name)
for name, (rows, labels) in sets.items():
    areas = []
    for seed in range(100):
        forest = IsolationForest(n_estimators=100, max_samples=256, random_state=seed).fit(rows)
        areas.append(roc_auc_score(labels, -forest.score_samples(rows)))
    print(f"{name}: {np.mean(areas):.5f} +- {np.std(areas, ddof=1):.5f}")
