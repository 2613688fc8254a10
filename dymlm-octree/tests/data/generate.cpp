// Writes the files beside it with OctoMap itself (made with Debian's liboctomap-dev 1.9.7):
//   g++ -O2 generate.cpp -o generate -loctomap -loctomath && ./generate
// tests/octomap.rs makes the same scans and compares.
#include <octomap/ColorOcTree.h>
#include <octomap/octomap.h>

#include <cstdint>
#include <fstream>

using namespace octomap;

// Knuth's MMIX generator, the same as in the tests.
struct Random {
  uint64_t state = 7;
  // Multiples of 1 / 1024 within +-2, exact in single precision.
  float next() {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return float(int(state >> 52) - 2048) / 1024.0f;
  }
  point3d point(float scale) {
    float x = next() * scale, y = next() * scale, z = next() * scale;
    return point3d(x, y, z);
  }
};

// Three scans of twelve points each; some lie beyond the range, some share cells.
template <class TREE>
void insertScattered(TREE& tree, double range, bool discretize) {
  Random random;
  for (int scan = 0; scan < 3; ++scan) {
    point3d origin = random.point(0.5f);
    Pointcloud cloud;
    for (int i = 0; i < 12; ++i) cloud.push_back(random.point(2.0f));
    cloud.push_back(cloud[0]);
    cloud.push_back(cloud[1] + point3d(0.0625f, 0, 0));
    tree.insertPointCloud(cloud, origin, range, false, discretize);
  }
}

// Eight scans of the walls of a cube of 3 m: clamped free space that is pruned.
Pointcloud walls() {
  Pointcloud cloud;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = -1; side <= 1; side += 2)
      for (int i = -8; i < 8; ++i)
        for (int j = -8; j < 8; ++j) {
          point3d p;
          p(axis) = 1.53125f * side;
          p((axis + 1) % 3) = (i + 0.5f) * 0.1875f;
          p((axis + 2) % 3) = (j + 0.5f) * 0.1875f;
          cloud.push_back(p);
        }
  return cloud;
}

int main() {
  OcTree scattered(0.2), perPoint(0.2);
  insertScattered(scattered, 2.5, true);
  insertScattered(perPoint, 2.5, false);
  scattered.write("scattered.ot");
  perPoint.write("per_point.ot");

  OcTree room(0.25);
  Pointcloud cloud = walls();
  for (int i = 0; i < 8; ++i) room.insertPointCloud(cloud, point3d(0.03125f * i, 0.0625f, 0.125f), -1, false, true);
  room.write("room.ot");

  // 64 rays: whether they hit, and the cell they end at.
  std::ofstream rays("rays.txt");
  rays.precision(9);
  Random random;
  for (int i = 0; i < 64; ++i) {
    point3d origin = random.point(0.5f), direction = random.point(1.0f), end;
    bool pass = i % 2;
    bool hit = room.castRay(origin, direction, end, pass, i % 4 < 2 ? 2.0 : 1.4);
    OcTreeKey key = room.coordToKey(end);
    rays << hit << ' ' << key[0] << ' ' << key[1] << ' ' << key[2] << '\n';
  }
  OcTree copy(room);
  copy.writeBinary("room.bt");

  ColorOcTree colored(0.2);
  insertScattered(colored, -1, true);
  Random again;
  for (int scan = 0; scan < 3; ++scan) {
    again.point(0.5f);
    for (int i = 0; i < 12; ++i) {
      point3d p = again.point(2.0f);
      colored.averageNodeColor(p.x(), p.y(), p.z(), 20 * i, 100 + scan, 250 - 20 * i);
    }
  }
  colored.updateInnerOccupancy();
  colored.write("colored.ot");
}
