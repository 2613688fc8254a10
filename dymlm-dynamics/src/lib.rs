//! Finds the moving things of an RGB-D frame: box tracking, missed detections, box correction, static mask.
