//! Multi-level maps of the static world from RGB-D frames while people walk through: cloud, octree, planes, objects.
