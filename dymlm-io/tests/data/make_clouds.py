# Writes the PLY and PCD files of this folder. Run with Open3D 0.20.0: python make_clouds.py
import numpy as np
import open3d as o3d

i = np.arange(12)
points = np.stack([0.25 * i - 1.0, 0.1 * i * i, 2.0 - i / 3.0], axis=1)
colors = np.stack([20 * i, 255 - 20 * i, 7 * i + 1], axis=1) / 255.0
cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
cloud.colors = o3d.utility.Vector3dVector(colors)
cloud.normals = o3d.utility.Vector3dVector(np.tile([0.0, 0.0, 1.0], (12, 1)))
o3d.io.write_point_cloud("open3d_ascii.ply", cloud, write_ascii=True)
o3d.io.write_point_cloud("open3d_binary.ply", cloud)
o3d.io.write_point_cloud("open3d_ascii.pcd", cloud, write_ascii=True)
o3d.io.write_point_cloud("open3d_binary.pcd", cloud)
o3d.io.write_point_cloud("open3d_compressed.pcd", cloud, compressed=True)
