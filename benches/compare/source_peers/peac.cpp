// PEAC behind the protocol of compare.py, with its own settings but for the least number of pixels.

#include "protocol.hpp"

#include "AHCPlaneFitter.hpp"

namespace {

// The points of an image as PEAC reads them: millimetres, row by row.
struct Cloud {
  size_t columns, rows;
  std::vector<std::array<double, 3>> points;

  int width() const { return int(columns); }
  int height() const { return int(rows); }
  bool get(int row, int column, double& x, double& y, double& z) const {
    const std::array<double, 3>& point = points[size_t(row) * columns + size_t(column)];
    x = point[0], y = point[1], z = point[2];
    return z > 0;
  }
};

using Fitter = ahc::PlaneFitter<Cloud>;

const std::vector<Cloud>& clouds_of(const std::string& path) {
  static std::map<std::string, std::vector<Cloud>> files;
  std::vector<Cloud>& clouds = files[path];
  if (!clouds.empty()) return clouds;
  const DepthImages images(path);
  for (size_t image = 0; image < images.count(); ++image) {
    clouds.push_back({images.width, images.height, {}});
    for (size_t i = 0; i < images.pixels(); ++i) {
      const double z = 1e3 * images.image(image)[i];
      clouds.back().points.push_back({images.x(i, z), images.y(i, z), z});
    }
  }
  return clouds;
}

struct Found {
  std::vector<ahc::PlaneSeg::shared_ptr> planes;
  // The pixels of each plane.
  std::vector<std::vector<int>> members;
};

void write_planes(const std::string& path, const std::vector<Found>& found) {
  std::ofstream file(path, std::ios::binary);
  for (size_t i = 0; i < found.size(); ++i)
    for (size_t k = 0; k < found[i].planes.size(); ++k) {
      const ahc::PlaneSeg& plane = *found[i].planes[k];
      const double* normal = plane.normal;
      const double* center = plane.center;
      put(file, double(i));
      for (int axis = 0; axis < 3; ++axis) put(file, normal[axis]);
      put(file, -1e-3 * (normal[0] * center[0] + normal[1] * center[1] + normal[2] * center[2]));
      for (int axis = 0; axis < 3; ++axis) put(file, 1e-3 * center[axis]);
      put(file, double(found[i].members[k].size()));
    }
}

Timing planes(const Request& request) {
  const std::vector<Cloud>& clouds = clouds_of(request.text("input"));
  Fitter fitter;
  fitter.minSupport = int(request.number("min_support"));
  std::vector<Found> found(clouds.size());
  const Timing timing = timed([&] {
    for (size_t i = 0; i < clouds.size(); ++i) {
      // Refinement is left out unless somebody asks which pixels are whose.
      fitter.run(&clouds[i], &found[i].members, nullptr, nullptr, false);
      found[i].planes = fitter.extractedPlanes;
    }
  });
  if (!request.result().empty()) write_planes(request.result(), found);
  return timing;
}

}  // namespace

int main() {
  return serve([](const Request& request) {
    if (request.operation == "planes") return planes(request);
    throw std::runtime_error("no operation " + request.operation);
  });
}
