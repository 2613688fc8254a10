//! Synthetic RGB-D scenes with exact truth, sensor and detector noise, and metrics for maps.
