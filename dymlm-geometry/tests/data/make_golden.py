"""Makes the golden files of this folder:  python make_golden.py

points.csv: 1500 points, x,y,z in metres with 4 decimals: two arcs, three blobs of different density that nearly
touch, a plane patch, duplicates, uniform noise.
dbscan_labels.csv: labels by scikit-learn (DBSCAN(eps, min_samples, algorithm="brute")), one row a setting:
eps,min_samples,label of each point (-1 is noise).
outliers.csv: inliers by Open3D's remove_statistical_outlier on the same points, one row a setting:
nb_neighbors,std_ratio,indices.

Made with scikit-learn 1.9.1, open3d 0.20.0, numpy 2.4.6.
"""
import numpy as np
import open3d
from sklearn.cluster import DBSCAN

rng = np.random.default_rng(20130915)


def arc(n, start, centre):
    a = rng.uniform(start, start + np.pi, n)
    return np.stack([np.cos(a), np.sin(a), 0 * a], 1) * 0.5 + centre + rng.normal(0, 0.02, (n, 3))


parts = [
    arc(220, 0.0, [0, 0, 0]),
    arc(220, np.pi, [0.5, 0.2, 0]),
    rng.normal([1.5, 0, 0], 0.05, (250, 3)),
    rng.normal([1.75, 0.1, 0], 0.08, (200, 3)),
    rng.normal([1.5, 0.6, 0.2], 0.15, (200, 3)),
    np.c_[rng.uniform(-0.4, 0.4, (200, 2)), np.full(200, 0.75)],
    rng.uniform(-1, 2.2, (180, 3)),
]
points = np.concatenate(parts)
points = np.concatenate([points, points[rng.integers(0, len(points), 1500 - len(points))]])
points = np.round(points[rng.permutation(len(points))], 4).astype(np.float32)
np.savetxt("points.csv", points, fmt="%.4f", delimiter=",")
exact = points.astype(np.float64)

with open("dbscan_labels.csv", "w") as file:
    for eps, min_samples in [(0.05, 5), (0.07, 10), (0.1, 4), (0.1, 15), (0.2, 10), (0.03, 1)]:
        found = DBSCAN(eps=float(np.float32(eps)), min_samples=min_samples, algorithm="brute").fit(exact)
        file.write(f"{eps},{min_samples}," + ",".join(map(str, found.labels_)) + "\n")
        print(eps, min_samples, found.labels_.max() + 1, "clusters,", (found.labels_ < 0).sum(), "noise,",
              (found.labels_ >= 0).sum() - len(found.core_sample_indices_), "border points")

cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(exact))
with open("outliers.csv", "w") as file:
    for nb_neighbors, std_ratio in [(21, 2.0), (9, 1.0), (51, 0.5)]:
        _, inliers = cloud.remove_statistical_outlier(nb_neighbors, std_ratio)
        file.write(f"{nb_neighbors},{std_ratio}," + ",".join(map(str, sorted(inliers))) + "\n")
        print(nb_neighbors, std_ratio, len(inliers), "inliers")
