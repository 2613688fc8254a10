// Bonxai behind the protocol of compare.py: its probabilistic map, with OctoMap's probabilities.

#include <limits>
#include <memory>

#include "bonxai_map/probabilistic_map.hpp"
#include "protocol.hpp"

namespace {

using Bonxai::CoordT;
using Bonxai::ProbabilisticMap;
using Point = ProbabilisticMap::Vector3D;

struct Scan {
  Point origin;
  std::vector<Point> points;
};

const std::vector<Scan>& scans_of(const std::string& path) {
  static std::map<std::string, std::vector<Scan>> files;
  std::vector<Scan>& scans = files[path];
  if (!scans.empty()) return scans;
  const std::vector<float> numbers = read_floats(path);
  for (const Frame& frame : frames_in(numbers)) {
    scans.push_back({Point(frame.origin[0], frame.origin[1], frame.origin[2]), {}});
    scans.back().points.reserve(frame.count);
    for (const float* point = frame.points; point != frame.points + 3 * frame.count; point += 3)
      scans.back().points.emplace_back(point[0], point[1], point[2]);
  }
  return scans;
}

// Its own limits are OctoMap's, rounded.
void use_limits_of_octomap(ProbabilisticMap& map) {
  ProbabilisticMap::Options options;
  options.clamp_min_log = ProbabilisticMap::logods(0.1192f);
  options.clamp_max_log = ProbabilisticMap::logods(0.971f);
  map.setOptions(options);
}

void insert_all(ProbabilisticMap& map, const std::vector<Scan>& scans, size_t count, const Request& request) {
  // A ray of Bonxai leads to a cell, however many points are in it.
  if (request.text("rays") != "per_cell") throw std::runtime_error("one ray a cell is all there is");
  const double range = request.number("max_range");
  for (size_t i = 0; i < std::min(count, scans.size()); ++i)
    map.insertPointCloud(scans[i].points, scans[i].origin, range);
}

// Cells that were allotted but never seen have log-odds of zero, and are left out.
void write_cells(const std::string& path, ProbabilisticMap& map) {
  std::ofstream file(path, std::ios::binary);
  put(file, uint64_t(map.grid().activeCellsCount()));
  put(file, uint64_t(map.grid().memUsage()));
  map.grid().forEachCell([&](const ProbabilisticMap::CellT& cell, const CoordT& coord) {
    const int key[3] = {coord.x + 32768, coord.y + 32768, coord.z + 32768};
    if (cell.probability_log != 0) put_leaf(file, key, 16, 1e-6f * float(cell.probability_log));
  });
}

Timing octree_insert(const Request& request) {
  const std::vector<Scan>& scans = scans_of(request.text("frames"));
  const auto limit = size_t(request.number("limit"));
  ProbabilisticMap map(request.number("resolution"));
  use_limits_of_octomap(map);
  const Timing timing = timed([&] { insert_all(map, scans, limit, request); });
  if (!request.result().empty()) write_cells(request.result(), map);
  return timing;
}

ProbabilisticMap& map_of(const Request& request) {
  static std::map<std::string, std::unique_ptr<ProbabilisticMap>> maps;
  const std::string& path = request.text("frames");
  auto& map = maps[path + " " + request.text("resolution") + " " + request.text("max_range")];
  if (!map) {
    map = std::make_unique<ProbabilisticMap>(request.number("resolution"));
    use_limits_of_octomap(*map);
    insert_all(*map, scans_of(path), std::numeric_limits<size_t>::max(), request);
  }
  return *map;
}

// By an accessor of its grid, the only way of reading that it has.
Timing octree_query(const Request& request) {
  const ProbabilisticMap& map = map_of(request);
  const std::vector<float> points = read_floats(request.text("points"));
  const int32_t threshold = map.options().occupancy_threshold_log;

  std::vector<uint8_t> states;
  states.reserve(points.size() / 3);
  const Timing timing = timed([&] {
    const auto accessor = map.grid().createConstAccessor();
    for (size_t i = 0; i + 3 <= points.size(); i += 3) {
      const CoordT coord = map.grid().posToCoord(points[i], points[i + 1], points[i + 2]);
      const auto* cell = accessor.value(coord);
      states.push_back(!cell || cell->probability_log == threshold ? 0 : cell->probability_log > threshold ? 2 : 1);
    }
  });
  write_states(request.result(), states);
  return timing;
}

Timing run(const Request& request) {
  if (request.operation == "octree_insert") return octree_insert(request);
  if (request.operation == "octree_query") return octree_query(request);
  throw std::runtime_error("no operation " + request.operation);
}

}  // namespace

int main() { return serve(run); }
