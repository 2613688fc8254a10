//! Probabilistic occupancy octree with the model and the files of OctoMap.
