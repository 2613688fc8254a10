// small_gicp behind the protocol of compare.py: its voxel grid, for one thread.

#include "protocol.hpp"

#include <numeric>

#include <small_gicp/points/point_cloud.hpp>
#include <small_gicp/util/downsampling.hpp>

namespace {

using small_gicp::PointCloud;

const PointCloud& cloud_of(const std::string& path) {
  static std::map<std::string, PointCloud> clouds;
  PointCloud& cloud = clouds[path];
  if (cloud.empty()) {
    const std::vector<float> numbers = read_floats(path);
    cloud.resize(numbers.size() / 3);
    for (size_t i = 0; i < cloud.size(); ++i)
      cloud.point(i) << numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2], 1.0;
  }
  return cloud;
}

Timing voxel_grid(const Request& request) {
  const PointCloud& cloud = cloud_of(request.text("input"));
  const double size = request.number("voxel_size");
  PointCloud::Ptr downsampled;
  const Timing timing = timed([&] { downsampled = small_gicp::voxelgrid_sampling(cloud, size); });
  if (!request.result().empty()) {
    std::ofstream file(request.result(), std::ios::binary);
    for (size_t i = 0; i < downsampled->size(); ++i)
      for (int axis = 0; axis < 3; ++axis) put(file, float(downsampled->point(i)[axis]));
  }
  return timing;
}

}  // namespace

int main() {
  return serve([](const Request& request) {
    if (request.operation == "voxel_grid") return voxel_grid(request);
    throw std::runtime_error("no operation " + request.operation);
  });
}
