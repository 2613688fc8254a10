// UFOMap behind the protocol of compare.py, with its own settings: OctoMap's probabilities.

#include "protocol.hpp"

#include <ufo/map/occupancy_map.h>
#include <ufo/map/point_cloud.h>

namespace {

using ufo::map::OccupancyMap;

struct Scan {
  ufo::map::Point3 origin;
  ufo::map::PointCloud points;
};

const std::vector<Scan>& scans_of(const std::string& path) {
  static std::map<std::string, std::vector<Scan>> files;
  std::vector<Scan>& scans = files[path];
  if (!scans.empty()) return scans;
  const std::vector<float> numbers = read_floats(path);
  for (const Frame& frame : frames_in(numbers)) {
    scans.emplace_back();
    scans.back().origin = {frame.origin[0], frame.origin[1], frame.origin[2]};
    scans.back().points.reserve(frame.count);
    for (const float* point = frame.points; point != frame.points + 3 * frame.count; point += 3)
      scans.back().points.push_back({point[0], point[1], point[2]});
  }
  return scans;
}

void write_leaves(const std::string& path, const OccupancyMap& map) {
  std::ofstream file(path, std::ios::binary);
  put(file, uint64_t(map.getNumInnerNodes() + map.getNumLeafNodes()));
  put(file, uint64_t(map.memoryUsage()));
  for (auto leaf = map.beginLeaves(), end = map.endLeaves(); leaf != end; ++leaf) {
    const double occupancy = leaf.getOccupancy();
    put_leaf(file, map.toKey(leaf.getCode()), 16 - int(leaf.getDepth()), float(std::log(occupancy / (1 - occupancy))));
  }
}

Timing octree_insert(const Request& request) {
  if (request.text("rays") != "per_cell") throw std::runtime_error("asked for one ray a cell only");
  const std::vector<Scan>& scans = scans_of(request.text("frames"));
  const auto limit = std::min(size_t(request.number("limit")), scans.size());
  // -1 is its word for no limit.
  const double range = std::isinf(request.number("max_range")) ? -1.0 : request.number("max_range");
  OccupancyMap map(request.number("resolution"));
  const Timing timing = timed([&] {
    for (size_t i = 0; i < limit; ++i) map.insertPointCloudDiscrete(scans[i].origin, scans[i].points, range);
  });
  if (!request.result().empty()) write_leaves(request.result(), map);
  return timing;
}

}  // namespace

int main() {
  return serve([](const Request& request) {
    if (request.operation == "octree_insert") return octree_insert(request);
    throw std::runtime_error("no operation " + request.operation);
  });
}
