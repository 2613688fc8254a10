// CAPE behind the protocol of compare.py, with the settings of its own demo but for cylinders, which ours does not look for.

// First, since the headers of CAPE use names of std without saying so.
#include "protocol.hpp"

#include <climits>
#include <memory>

#include "CAPE.h"

namespace {

constexpr int CELL = 20;
const float MIN_COS_ANGLE = float(std::cos(M_PI / 12)), MAX_MERGE_DISTANCE = 50.0f;

// Clouds in millimetres, as CAPE's constants are, row by row of the image; zeros where there is no reading.
struct Clouds {
  int width, height;
  // For each pixel, its place in a cloud that holds one cell after the other.
  std::vector<int> places;
  std::vector<Eigen::MatrixXf> clouds;

  explicit Clouds(const DepthImages& images) : width(int(images.width)), height(int(images.height)) {
    if (width % CELL != 0 || height % CELL != 0) throw std::runtime_error("the image is no whole number of cells");
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u)
        places.push_back(((v / CELL) * (width / CELL) + u / CELL) * CELL * CELL + (v % CELL) * CELL + u % CELL);
    for (size_t image = 0; image < images.count(); ++image) {
      clouds.emplace_back(images.pixels(), 3);
      for (size_t i = 0; i < images.pixels(); ++i) {
        const double z = 1e3 * images.image(image)[i];
        clouds.back().row(Eigen::Index(i)) << float(images.x(i, z)), float(images.y(i, z)), float(z);
      }
    }
  }

  // Part of what its demo measures.
  void organize_by_cell(const Eigen::MatrixXf& cloud, Eigen::MatrixXf& organized) const {
    for (int axis = 0; axis < 3; ++axis)
      for (size_t i = 0; i < places.size(); ++i) organized(places[i], axis) = cloud(Eigen::Index(i), axis);
  }
};

const Clouds& clouds_of(const std::string& path) {
  static std::map<std::string, std::unique_ptr<Clouds>> files;
  std::unique_ptr<Clouds>& clouds = files[path];
  if (!clouds) clouds = std::make_unique<Clouds>(DepthImages(path));
  return *clouds;
}

struct Found {
  std::vector<PlaneSeg> planes;
  // For each pixel the number of its plane, from 1; 0 for none.
  cv::Mat labels;
};

void write_planes(const std::string& path, const std::vector<Found>& found) {
  std::ofstream file(path, std::ios::binary);
  for (size_t i = 0; i < found.size(); ++i)
    for (size_t k = 0; k < found[i].planes.size(); ++k) {
      const PlaneSeg& plane = found[i].planes[k];
      put(file, double(i));
      for (const double part : plane.normal) put(file, part);
      put(file, 1e-3 * plane.d);
      for (const double part : plane.mean) put(file, 1e-3 * part);
      put(file, double(cv::countNonZero(found[i].labels == int(k + 1))));
    }
}

Timing planes(const Request& request) {
  const Clouds& input = clouds_of(request.text("input"));
  CAPE detector(input.height, input.width, CELL, CELL, false, MIN_COS_ANGLE, MAX_MERGE_DISTANCE);
  Eigen::MatrixXf organized(input.width * input.height, 3);
  std::vector<Found> found(input.clouds.size());
  for (Found& image : found) image.labels = cv::Mat::zeros(input.height, input.width, CV_8U);
  const Timing timing = timed([&] {
    for (size_t i = 0; i < input.clouds.size(); ++i) {
      int planes, cylinders;
      std::vector<CylinderSeg> none;
      input.organize_by_cell(input.clouds[i], organized);
      detector.process(organized, planes, cylinders, found[i].labels, found[i].planes, none);
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
