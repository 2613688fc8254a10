// The C++ peers of compare.py: OctoMap, PCL's voxel grid and planes and CGAL's rectangles behind the protocol of `compare_ours`.
//
// A request is a line on standard input, `operation key=value ..`; the answer is `ok wall_seconds cpu_seconds` or
// `error message`. With result=PATH what was computed is written there after the clock has stopped. The files are
// those of benches/src/bin/compare_ours/{inputs,results}.rs.

#include <time.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#ifdef HAVE_OCTOMAP
#include <octomap/OcTree.h>
#endif
#ifdef HAVE_CGAL
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/convex_hull_2.h>
#include <CGAL/min_quadrilateral_2.h>
#endif
#ifdef HAVE_PCL
#include <pcl/features/integral_image_normal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/organized_multi_plane_segmentation.h>
#endif

namespace {

struct Request {
  std::string operation;
  std::map<std::string, std::string> parameters;

  explicit Request(const std::string& line) {
    std::istringstream words(line);
    words >> operation;
    for (std::string word; words >> word;) {
      const auto equals = word.find('=');
      if (equals == std::string::npos) throw std::runtime_error("no value in " + word);
      parameters[word.substr(0, equals)] = word.substr(equals + 1);
    }
  }

  const std::string& text(const std::string& key) const {
    const auto found = parameters.find(key);
    if (found == parameters.end()) throw std::runtime_error(operation + " needs " + key + "=");
    return found->second;
  }

  double number(const std::string& key) const { return std::stod(text(key)); }

  // Empty when nothing is to be written.
  std::string result() const {
    const auto found = parameters.find("result");
    return found == parameters.end() ? "" : found->second;
  }
};

struct Timing {
  double wall, cpu;
};

double seconds(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

template <class Work>
Timing timed(Work&& work) {
  const double wall = seconds(CLOCK_MONOTONIC), cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
  work();
  const double cpu_after = seconds(CLOCK_PROCESS_CPUTIME_ID);
  return {seconds(CLOCK_MONOTONIC) - wall, cpu_after - cpu};
}

std::vector<float> read_floats(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error(path + " cannot be read");
  std::vector<float> numbers(size_t(file.tellg()) / sizeof(float));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(numbers.data()), std::streamsize(numbers.size() * sizeof(float)));
  return numbers;
}

template <class T>
void put(std::ofstream& file, T value) {
  file.write(reinterpret_cast<const char*>(&value), sizeof value);
}

#ifdef HAVE_OCTOMAP

using octomap::OcTree;
using octomap::OcTreeKey;
using octomap::point3d;

struct Scan {
  point3d origin;
  octomap::Pointcloud points;
};

const std::vector<Scan>& frames(const std::string& path) {
  static std::map<std::string, std::vector<Scan>> files;
  const auto known = files.find(path);
  if (known != files.end()) return known->second;
  const std::vector<float> numbers = read_floats(path);
  std::vector<Scan>& scans = files[path];
  for (size_t i = 0; i + 4 <= numbers.size();) {
    uint32_t count;  // shares the array of floats as bits
    std::memcpy(&count, &numbers[i + 3], sizeof count);
    scans.emplace_back();
    scans.back().origin = point3d(numbers[i], numbers[i + 1], numbers[i + 2]);
    scans.back().points.reserve(count);
    i += 4;
    for (uint32_t k = 0; k < count; ++k, i += 3)
      scans.back().points.push_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  }
  return scans;
}

// -1 is OctoMap's word for no limit.
double max_range(const Request& request, const std::string& key) {
  const double range = request.number(key);
  return std::isinf(range) ? -1.0 : range;
}

void insert_all(OcTree& tree, const std::vector<Scan>& scans, size_t count, const Request& request) {
  const std::string& rays = request.text("rays");
  if (rays != "per_cell" && rays != "per_point") throw std::runtime_error("rays=" + rays + " is unknown");
  const double range = max_range(request, "max_range");
  for (size_t i = 0; i < std::min(count, scans.size()); ++i)
    tree.insertPointCloud(scans[i].points, scans[i].origin, range, false, rays == "per_cell");
}

const OcTree& map_of(const Request& request) {
  static std::map<std::string, std::unique_ptr<OcTree>> maps;
  const std::string& path = request.text("frames");
  auto& map = maps[path + " " + request.text("resolution") + " " + request.text("max_range")];
  if (!map) {
    map = std::make_unique<OcTree>(request.number("resolution"));
    insert_all(*map, frames(path), std::numeric_limits<size_t>::max(), request);
  }
  return *map;
}

void write_leaves(const std::string& path, const OcTree& tree) {
  std::ofstream file(path, std::ios::binary);
  put(file, uint64_t(tree.size()));
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const OcTreeKey key = leaf.getIndexKey();
    for (int axis = 0; axis < 3; ++axis) put(file, uint16_t(key[axis]));
    put(file, uint16_t(leaf.getDepth()));
    put(file, leaf->getLogOdds());
  }
}

Timing octree_insert(const Request& request) {
  const std::vector<Scan>& scans = frames(request.text("frames"));
  OcTree tree(request.number("resolution"));
  const auto limit = size_t(request.number("limit"));
  const Timing timing = timed([&] { insert_all(tree, scans, limit, request); });
  if (!request.result().empty()) write_leaves(request.result(), tree);
  return timing;
}

Timing octree_cast(const Request& request) {
  const OcTree& tree = map_of(request);
  const std::vector<float> rays = read_floats(request.text("rays_file"));
  const double range = max_range(request, "cast_range");
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();

  std::vector<point3d> hits;
  hits.reserve(rays.size() / 6);
  const Timing timing = timed([&] {
    for (size_t i = 0; i + 6 <= rays.size(); i += 6) {
      point3d end;
      const bool hit = tree.castRay(point3d(rays[i], rays[i + 1], rays[i + 2]),
                                    point3d(rays[i + 3], rays[i + 4], rays[i + 5]), end, true, range);
      hits.push_back(hit ? end : point3d(nan, nan, nan));
    }
  });
  if (!request.result().empty()) {
    std::ofstream file(request.result(), std::ios::binary);
    for (const point3d& hit : hits)
      for (unsigned axis = 0; axis < 3; ++axis) put(file, hit(axis));
  }
  return timing;
}

Timing octree_query(const Request& request) {
  const OcTree& tree = map_of(request);
  const std::vector<float> points = read_floats(request.text("points"));

  std::vector<uint8_t> states;
  states.reserve(points.size() / 3);
  const Timing timing = timed([&] {
    for (size_t i = 0; i + 3 <= points.size(); i += 3) {
      const auto* node = tree.search(double(points[i]), double(points[i + 1]), double(points[i + 2]));
      states.push_back(!node ? 0 : tree.isNodeOccupied(node) ? 2 : 1);
    }
  });
  if (!request.result().empty()) {
    std::ofstream file(request.result(), std::ios::binary);
    for (const uint8_t state : states) put(file, state);
  }
  return timing;
}

#endif  // HAVE_OCTOMAP

#ifdef HAVE_PCL

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

const Cloud::Ptr& cloud_of(const std::string& path) {
  static std::map<std::string, Cloud::Ptr> clouds;
  Cloud::Ptr& cloud = clouds[path];
  if (!cloud) {
    cloud.reset(new Cloud);
    const std::vector<float> numbers = read_floats(path);
    for (size_t i = 0; i + 3 <= numbers.size(); i += 3)
      cloud->push_back(pcl::PointXYZ(numbers[i], numbers[i + 1], numbers[i + 2]));
  }
  return cloud;
}

Timing voxel_grid(const Request& request) {
  static Cloud kept;
  Cloud fresh;
  Cloud& downsampled = request.text("buffers") == "kept" ? kept : fresh;
  const Cloud::Ptr& cloud = cloud_of(request.text("input"));
  const auto size = float(request.number("voxel_size"));
  const Timing timing = timed([&] {
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    grid.setLeafSize(size, size, size);
    grid.setInputCloud(cloud);
    grid.filter(downsampled);
  });
  if (!request.result().empty()) {
    std::ofstream file(request.result(), std::ios::binary);
    for (const pcl::PointXYZ& point : downsampled) {
      put(file, point.x);
      put(file, point.y);
      put(file, point.z);
    }
  }
  return timing;
}

// Depth images as organized clouds, NaN where there is no reading.
const std::vector<Cloud::Ptr>& organized_clouds_of(const std::string& path) {
  static std::map<std::string, std::vector<Cloud::Ptr>> files;
  std::vector<Cloud::Ptr>& clouds = files[path];
  if (!clouds.empty()) return clouds;
  const std::vector<float> numbers = read_floats(path);
  if (numbers.size() < 6) throw std::runtime_error(path + " has no header");
  uint32_t size[2];  // shares the array of floats as bits
  std::memcpy(size, numbers.data(), sizeof size);
  const double fx = numbers[2], fy = numbers[3], cx = numbers[4], cy = numbers[5];
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const size_t pixels = size_t(size[0]) * size[1];
  for (size_t start = 6; start + pixels <= numbers.size(); start += pixels) {
    clouds.emplace_back(new Cloud(size[0], size[1], pcl::PointXYZ(nan, nan, nan)));
    clouds.back()->is_dense = false;
    for (size_t i = 0; i < pixels; ++i) {
      const double z = numbers[start + i];
      if (z > 0)
        (*clouds.back())[i] = pcl::PointXYZ(float((double(i % size[0]) - cx) / fx * z),
                                            float((double(i / size[0]) - cy) / fy * z), float(z));
    }
  }
  return clouds;
}

// The settings of PCL's own organized_segmentation_demo, but for the number of inliers.
Timing planes(const Request& request) {
  using Region = pcl::PlanarRegion<pcl::PointXYZ>;
  using Regions = std::vector<Region, Eigen::aligned_allocator<Region>>;
  const std::vector<Cloud::Ptr>& clouds = organized_clouds_of(request.text("input"));
  std::vector<Regions> found(clouds.size());
  const Timing timing = timed([&] {
    for (size_t i = 0; i < clouds.size(); ++i) {
      pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
      estimation.setNormalEstimationMethod(estimation.COVARIANCE_MATRIX);
      estimation.setMaxDepthChangeFactor(0.02f);
      estimation.setNormalSmoothingSize(20.0f);
      pcl::PointCloud<pcl::Normal>::Ptr normals(new pcl::PointCloud<pcl::Normal>);
      estimation.setInputCloud(clouds[i]);
      estimation.compute(*normals);

      pcl::OrganizedMultiPlaneSegmentation<pcl::PointXYZ, pcl::Normal, pcl::Label> segmentation;
      segmentation.setMinInliers(unsigned(request.number("min_support")));
      segmentation.setAngularThreshold(3.0 * M_PI / 180.0);
      segmentation.setDistanceThreshold(0.02);
      segmentation.setInputNormals(normals);
      segmentation.setInputCloud(clouds[i]);
      segmentation.segmentAndRefine(found[i]);
    }
  });
  if (!request.result().empty()) {
    std::ofstream file(request.result(), std::ios::binary);
    for (size_t i = 0; i < found.size(); ++i)
      for (const Region& region : found[i]) {
        put(file, double(i));
        for (int k = 0; k < 4; ++k) put(file, double(region.getCoefficients()[k]));
        for (int k = 0; k < 3; ++k) put(file, double(region.getCentroid()[k]));
        put(file, double(region.getCount()));
      }
  }
  return timing;
}

#endif  // HAVE_PCL

#ifdef HAVE_CGAL

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using PlanePoint = Kernel::Point_2;

const std::vector<PlanePoint>& plane_points(const std::string& path) {
  static std::map<std::string, std::vector<PlanePoint>> clouds;
  std::vector<PlanePoint>& cloud = clouds[path];
  if (cloud.empty()) {
    const std::vector<float> numbers = read_floats(path);
    for (size_t i = 0; i + 3 <= numbers.size(); i += 3) cloud.emplace_back(numbers[i], numbers[i + 1]);
  }
  return cloud;
}

Timing minimum_area_rectangle(const Request& request) {
  const std::vector<PlanePoint>& points = plane_points(request.text("input"));
  std::vector<PlanePoint> hull, corners;
  const Timing timing = timed([&] {
    CGAL::convex_hull_2(points.begin(), points.end(), std::back_inserter(hull));
    CGAL::min_rectangle_2(hull.begin(), hull.end(), std::back_inserter(corners));
  });
  if (!request.result().empty()) {
    std::ofstream file(request.result(), std::ios::binary);
    for (const PlanePoint& corner : corners) {
      put(file, corner.x());
      put(file, corner.y());
    }
  }
  return timing;
}

#endif  // HAVE_CGAL

Timing run(const Request& request) {
#ifdef HAVE_OCTOMAP
  if (request.operation == "octree_insert") return octree_insert(request);
  if (request.operation == "octree_cast") return octree_cast(request);
  if (request.operation == "octree_query") return octree_query(request);
#endif
#ifdef HAVE_CGAL
  if (request.operation == "minimum_area_rectangle") return minimum_area_rectangle(request);
#endif
#ifdef HAVE_PCL
  if (request.operation == "voxel_grid") return voxel_grid(request);
  if (request.operation == "planes") return planes(request);
#endif
  throw std::runtime_error("no operation " + request.operation);
}

}  // namespace

int main() {
  for (std::string line; std::getline(std::cin, line);) {
    try {
      const Timing timing = run(Request(line));
      std::cout << std::fixed << std::setprecision(9) << "ok " << timing.wall << " " << timing.cpu << std::endl;
    } catch (const std::exception& error) {
      std::cout << "error " << error.what() << std::endl;
    }
  }
}
