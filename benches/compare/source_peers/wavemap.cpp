// wavemap behind the protocol of compare.py, with the settings that it has for RGB-D cameras
// (wavemap_panoptic_mapping_rgbd.yaml), but for the camera and the cell size.

#include "protocol.hpp"

#include <memory>

#include <wavemap/core/integrator/measurement_model/continuous_ray.h>
#include <wavemap/core/integrator/projection_model/pinhole_camera_projector.h>
#include <wavemap/core/integrator/projective/coarse_to_fine/hashed_chunked_wavelet_integrator.h>
#include <wavemap/core/map/hashed_chunked_wavelet_octree.h>
#include <wavemap/core/utils/query/occupancy_classifier.h>

namespace {

using wavemap::HashedChunkedWaveletIntegrator;
using wavemap::HashedChunkedWaveletOctree;
using wavemap::PinholeCameraProjector;
using Image = wavemap::PosedImage<>;

struct Recording {
  std::shared_ptr<const PinholeCameraProjector> camera;
  std::vector<Image> images;
};

// From translation and quaternion x y z w.
wavemap::Transformation3D pose_of(const double* numbers) {
  const Eigen::Map<const Eigen::Matrix<double, 7, 1>> all(numbers);
  const Eigen::Matrix<float, 7, 1> pose = all.cast<float>();
  const Eigen::Quaternionf turn(pose[6], pose[3], pose[4], pose[5]);
  return wavemap::Transformation3D{wavemap::Rotation3D{turn.normalized()}, wavemap::Point3D{pose.head<3>()}};
}

const Recording& recording_of(const Request& request) {
  static std::map<std::string, Recording> files;
  Recording& recording = files[request.text("images")];
  if (!recording.images.empty()) return recording;
  const DepthImages depths(request.text("images"));
  const std::vector<double> poses = read_numbers<double>(request.text("poses"));
  const int width = int(depths.width), height = int(depths.height);
  recording.camera = std::make_shared<PinholeCameraProjector>(wavemap::PinholeCameraProjectorConfig(
      float(depths.fx), float(depths.fy), float(depths.cx), float(depths.cy), height, width));
  for (size_t i = 0; i < depths.count(); ++i) {
    // Its rows are our columns, and it stores column by column: the same order of pixels.
    recording.images.emplace_back(width, height);
    recording.images.back().setPose(pose_of(&poses[7 * i]));
    std::copy_n(depths.image(i), depths.pixels(), recording.images.back().getData().data());
  }
  return recording;
}

std::shared_ptr<HashedChunkedWaveletOctree> new_map(const Request& request) {
  wavemap::HashedChunkedWaveletOctreeConfig config;
  config.min_cell_width = float(request.number("resolution"));
  return std::make_shared<HashedChunkedWaveletOctree>(config);
}

HashedChunkedWaveletIntegrator new_integrator(const Request& request, const Recording& recording,
                                              const std::shared_ptr<HashedChunkedWaveletOctree>& map) {
  const auto range_image = std::make_shared<Image>(recording.camera->getDimensions());
  const auto offsets = std::make_shared<wavemap::Image<wavemap::Vector2D>>(recording.camera->getDimensions());
  const auto model = std::make_shared<wavemap::ContinuousRay>(wavemap::ContinuousRayConfig(0.01f, 0.2f, 0.4f),
                                                              recording.camera, range_image);
  const wavemap::ProjectiveIntegratorConfig config(0.1f, float(request.number("max_range")));
  const auto one_thread = std::make_shared<wavemap::ThreadPool>(1);
  return {config, recording.camera, range_image, offsets, model, map, one_thread};
}

void write_leaves(const std::string& path, const HashedChunkedWaveletOctree& map) {
  std::ofstream file(path, std::ios::binary);
  put(file, uint64_t(map.size()));
  put(file, uint64_t(map.getMemoryUsage()));
  map.forEachLeaf([&](const wavemap::OctreeIndex& index, float log_odds) {
    if (wavemap::OccupancyClassifier::isUnobserved(log_odds)) return;
    const wavemap::Index3D key = index.position * (1 << index.height) + wavemap::Index3D::Constant(32768);
    put_leaf(file, key, 16 - index.height, log_odds);
  });
}

Timing octree_insert(const Request& request) {
  const Recording& recording = recording_of(request);
  const auto limit = std::min(size_t(request.number("limit")), recording.images.size());
  const auto map = new_map(request);
  const Timing timing = timed([&] {
    HashedChunkedWaveletIntegrator integrator = new_integrator(request, recording, map);
    for (size_t i = 0; i < limit; ++i) integrator.integrate(recording.images[i]);
    // What it does every two seconds: log-odds are brought within their limits.
    map->threshold();
  });
  // Pruned only for the count of memory, since it prunes every ten seconds.
  map->prune();
  if (!request.result().empty()) write_leaves(request.result(), *map);
  return timing;
}

}  // namespace

int main() {
  return serve([](const Request& request) {
    if (request.operation == "octree_insert") return octree_insert(request);
    throw std::runtime_error("no operation " + request.operation);
  });
}
