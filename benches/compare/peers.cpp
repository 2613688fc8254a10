// The C++ peers of compare.py that Debian has: OctoMap, PCL's voxel grid and planes and CGAL's rectangles.

#include "protocol.hpp"

#include <array>
#include <limits>
#include <memory>

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
  for (const Frame& frame : frames_in(numbers)) {
    scans.emplace_back();
    scans.back().origin = point3d(frame.origin[0], frame.origin[1], frame.origin[2]);
    scans.back().points.reserve(frame.count);
    for (const float* point = frame.points; point != frame.points + 3 * frame.count; point += 3)
      scans.back().points.push_back(point[0], point[1], point[2]);
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
  put(file, uint64_t(tree.memoryUsage()));
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const OcTreeKey key = leaf.getIndexKey();
    put_leaf(file, key, int(leaf.getDepth()), leaf->getLogOdds());
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
  write_states(request.result(), states);
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
  const DepthImages images(path);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (size_t image = 0; image < images.count(); ++image) {
    clouds.emplace_back(new Cloud(unsigned(images.width), unsigned(images.height), pcl::PointXYZ(nan, nan, nan)));
    clouds.back()->is_dense = false;
    for (size_t i = 0; i < images.pixels(); ++i) {
      const double z = images.image(image)[i];
      if (z > 0) (*clouds.back())[i] = pcl::PointXYZ(float(images.x(i, z)), float(images.y(i, z)), float(z));
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

int main() { return serve(run); }
