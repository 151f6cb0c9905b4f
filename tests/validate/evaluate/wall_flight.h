#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/log.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/evaluate/evaluate.h"

/// Truths in closed form, and writers of results by the formats' published layouts, for the tests
/// of evaluate.
namespace terracast::test {

constexpr int kWallWidth = 96;
constexpr int kWallHeight = 72;
constexpr double kWallFocal_px = 130.0;
constexpr double kWallBaseline_m = 0.5;

/// KITTI's pair before a wall at one depth, moving by `step_camera` (right, down, forward) from
/// frame to frame without a turn.
inline Recording wall_flight(int num_frames, double depth_m, const Eigen::Vector3d& step_camera) {
  Recording recording;
  recording.cameras = kitti_cameras();
  for (SceneCamera& camera : recording.cameras) {
    camera.width = kWallWidth;
    camera.height = kWallHeight;
  }
  const auto count = static_cast<std::size_t>(num_frames);
  for (int frame = 0; frame < num_frames; ++frame) {
    recording.body_world.emplace_back(recording.cameras[0].body_from_camera * step_camera *
                                      static_cast<double>(frame));
    recording.world_from_body.push_back(Eigen::Matrix3d::Identity());
  }
  recording.color.assign(2, std::vector(count, core::Image8(kWallWidth, kWallHeight, 3, 100)));
  recording.depth.assign(
      2, std::vector(count, core::Image<double>(kWallWidth, kWallHeight, 1, depth_m)));
  return recording;
}

/// Where the wall's point of a pixel stands in the next image, less that pixel.
inline Eigen::Vector2d wall_flow(int x, int y, double depth_m, const Eigen::Vector3d& step_camera) {
  const double dx = x + 0.5 - 0.5 * kWallWidth, dy = y + 0.5 - 0.5 * kWallHeight;
  const double then_m = depth_m - step_camera.z();
  return {(dx * depth_m - kWallFocal_px * step_camera.x()) / then_m - dx,
          (dy * depth_m - kWallFocal_px * step_camera.y()) / then_m - dy};
}

/// Little-endian values one after the other.
class ByteWriter {
 public:
  template <class Value>
  ByteWriter& put(Value value) {
    char bytes[sizeof(Value)];
    std::memcpy(bytes, &value, sizeof(Value));
    text.append(bytes, sizeof(Value));
    return *this;
  }
  ByteWriter& put_text(const std::string& some) {
    text += some;
    return *this;
  }
  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(text)); }
  std::string text;
};

/// NumPy's format 1.0 (NEP 1).
template <class Value>
std::string npy_text(const std::string& shape, const std::vector<Value>& values) {
  const std::string type = std::is_same_v<Value, float> ? "<f4" : "<f8";
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  while ((header.size() + 11) % 64 != 0) header += ' ';
  header += '\n';
  ByteWriter file;
  file.put_text("\x93NUMPY").put('\x01').put('\0');
  file.put(static_cast<std::uint16_t>(header.size())).put_text(header);
  for (const Value value : values) file.put(value);
  return file.text;
}

/// Middlebury's .flo.
/// flow  u, v of each pixel, row by row
inline std::string flo_text(int width, int height, const std::vector<float>& flow) {
  ByteWriter file;
  file.put_text("PIEH").put(std::int32_t{width}).put(std::int32_t{height});
  for (const float value : flow) file.put(value);
  return file.text;
}

/// Flow of an image of the wall's size, by a function of the pixel.
template <class Function>
std::vector<float> flow_of_pixels(const Function& flow) {
  std::vector<float> values;
  for (int y = 0; y < kWallHeight; ++y)
    for (int x = 0; x < kWallWidth; ++x) {
      const Eigen::Vector2d at = flow(x, y);
      values.push_back(static_cast<float>(at.x()));
      values.push_back(static_cast<float>(at.y()));
    }
  return values;
}

inline void write_flo(const std::filesystem::path& file, const std::vector<float>& flow) {
  core::write_file(file, flo_text(kWallWidth, kWallHeight, flow));
}

/// An image of one channel of the wall's size.
inline void write_plane_npy(const std::filesystem::path& file, const std::vector<float>& values) {
  core::write_file(file, npy_text("72, 96", values));
}
inline std::vector<float> plane(double value) {
  return std::vector<float>(static_cast<std::size_t>(kWallWidth) * kWallHeight,
                            static_cast<float>(value));
}

inline validate::Evaluation evaluate(const validate::EvaluateOptions& options,
                                     const std::filesystem::path& report = {},
                                     int num_threads = 0) {
  const core::Log log("evaluate", core::LogLevel::Off);
  return validate::run_evaluate(options, report, {.log = log, .num_threads = num_threads});
}

/// A figure of the row of all.
inline double figure(const validate::Evaluation& evaluation, const std::string& measure) {
  for (std::size_t i = 0; i < evaluation.measures.size(); ++i)
    if (evaluation.measures[i].name == measure)
      return evaluation.rows.back().values[i].value_or(-1.0);
  ADD_FAILURE() << "no measure " << measure;
  return -1.0;
}

inline std::string notes_of(const validate::Evaluation& evaluation) {
  std::string text;
  for (const std::string& note : evaluation.notes) text += note + "\n";
  return text;
}

}  // namespace terracast::test
