//! Reads TUM RGB-D datasets and detections, reads and writes PLY, PCD and map folders.
