// What all C++ peers of compare.py share: the protocol of `compare_ours`, the clock and the files.
//
// A request is a line on standard input, `operation key=value ..`; the answer is `ok wall_seconds cpu_seconds` or
// `error message`. With result=PATH what was computed is written there after the clock has stopped. The files are
// those of benches/src/bin/compare_ours/{inputs,results}.rs.

#pragma once

#include <time.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

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

inline double seconds(clockid_t clock) {
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

template <class Number>
std::vector<Number> read_numbers(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error(path + " cannot be read");
  std::vector<Number> numbers(size_t(file.tellg()) / sizeof(Number));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(numbers.data()), std::streamsize(numbers.size() * sizeof(Number)));
  return numbers;
}

inline std::vector<float> read_floats(const std::string& path) { return read_numbers<float>(path); }

template <class T>
void put(std::ofstream& file, T value) {
  file.write(reinterpret_cast<const char*>(&value), sizeof value);
}

// A leaf of an octree: the key of its lowest cell, where 32768 is the cell above zero, depth (16: one cell) and log-odds.
template <class Key>
void put_leaf(std::ofstream& file, const Key& key, int depth, float log_odds) {
  for (int axis = 0; axis < 3; ++axis) put(file, uint16_t(key[axis]));
  put(file, uint16_t(depth));
  put(file, log_odds);
}

// States of cells: 0 unknown, 1 free, 2 occupied. Nothing is written without a path.
inline void write_states(const std::string& path, const std::vector<uint8_t>& states) {
  if (path.empty()) return;
  std::ofstream file(path, std::ios::binary);
  for (const uint8_t state : states) put(file, state);
}

// A posed scan in the world, metres: the sensor's position, and x, y, z of one point after the other.
struct Frame {
  const float* origin;
  const float* points;
  size_t count;
};

// The frames in the numbers of a file, which must outlive them.
inline std::vector<Frame> frames_in(const std::vector<float>& numbers) {
  std::vector<Frame> frames;
  for (size_t i = 0; i + 4 <= numbers.size();) {
    uint32_t count;  // shares the array of floats as bits
    std::memcpy(&count, &numbers[i + 3], sizeof count);
    frames.push_back({&numbers[i], numbers.data() + i + 4, count});
    i += 4 + 3 * size_t(count);
  }
  return frames;
}

// Depth images of one camera, metres, 0 where there is no reading.
struct DepthImages {
  size_t width, height;
  double fx, fy, cx, cy;
  std::vector<float> depths;

  explicit DepthImages(const std::string& path) : depths(read_floats(path)) {
    if (depths.size() < 6) throw std::runtime_error(path + " has no header");
    uint32_t size[2];  // shares the array of floats as bits
    std::memcpy(size, depths.data(), sizeof size);
    width = size[0], height = size[1];
    fx = depths[2], fy = depths[3], cx = depths[4], cy = depths[5];
    depths.erase(depths.begin(), depths.begin() + 6);
  }

  size_t pixels() const { return width * height; }
  size_t count() const { return depths.size() / pixels(); }
  const float* image(size_t index) const { return &depths[index * pixels()]; }

  // The point of a pixel, in the camera's frame, from its depth.
  double x(size_t pixel, double depth) const { return (double(pixel % width) - cx) / fx * depth; }
  double y(size_t pixel, double depth) const { return (double(pixel / width) - cy) / fy * depth; }
};

// Answers requests until there are none.
template <class Run>
int serve(Run&& run) {
  for (std::string line; std::getline(std::cin, line);) {
    try {
      const Timing timing = run(Request(line));
      std::cout << std::fixed << std::setprecision(9) << "ok " << timing.wall << " " << timing.cpu << std::endl;
    } catch (const std::exception& error) {
      std::cout << "error " << error.what() << std::endl;
    }
  }
  return 0;
}
