#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/image_io.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "tests/tiler/raster_files.h"
#include "tiler/objects/model_file.h"
#include "world/tile_id.h"

/// Models written in tests.
namespace terracast::test {

using Codes = std::array<std::uint8_t, 3>;

/// Read with z up and its own origin, so that places are the file's.
inline tiler::Model read_as_it_is(const std::filesystem::path& file) {
  tiler::ModelOptions options;
  options.name = "thing";
  options.file = {.written = file.filename().string(), .resolved = file};
  options.up = "z";
  options.origin = "model";
  std::uint64_t texture_bytes_left = world::kMaxTexturesBytes;
  return tiler::read_model(options, texture_bytes_left);
}

inline const world::Shape& finest(const tiler::Model& model) {
  return model.prototype.levels.at(0).shape;
}
inline Eigen::Vector3d corner(const world::Shape& shape, std::size_t triangle, std::size_t k) {
  return shape.vertices_steps.at(shape.triangles.at(triangle).corners.at(k)).cast<double>() *
         world::kHeightStep_m;
}
/// Twice its area, along its normal.
inline Eigen::Vector3d doubled_area(const world::Shape& shape, std::size_t triangle) {
  return (corner(shape, triangle, 1) - corner(shape, triangle, 0))
      .cross(corner(shape, triangle, 2) - corner(shape, triangle, 0));
}
inline Eigen::Vector2f uv(const world::Shape& shape, std::size_t triangle, std::size_t k) {
  return shape.uv.at(shape.triangles.at(triangle).corners.at(k));
}
inline const world::Finish& look(const tiler::Model& model, std::size_t triangle = 0) {
  return finest(model).finishes.at(finest(model).triangles.at(triangle).finish);
}
inline Codes color(const tiler::Model& model, std::size_t triangle = 0) {
  return look(model, triangle).color_srgb;
}
inline std::int64_t count_in(const tiler::Model& model, const std::string& name) {
  for (const auto& [own, count] : model.counts)
    if (own == name) return count;
  return 0;
}
inline const core::Ledger::Entry& entry(const tiler::Model& model, const std::string& name) {
  static const core::Ledger::Entry none;
  const auto found = model.ledger.entries().find(name);
  return found == model.ledger.entries().end() ? none : found->second;
}

/// A picture of two halves, the left one red and the right one blue.
inline void write_halves(const std::filesystem::path& file, int num_channels = 3) {
  core::Image8 image(2, 1, num_channels, 128);
  for (int x = 0; x < 2; ++x)
    for (int k = 0; k < 3; ++k) image(x, 0, k) = k == 2 * x ? 255 : 0;
  const auto png = core::encode_png(image);
  write_text(file, std::string(reinterpret_cast<const char*>(png.data()), png.size()));
}

inline std::string base64(const std::string& bytes) {
  constexpr const char* kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8U |
             (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : std::uint32_t{0});
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kLetters[bits >> (18 - 6 * k) & 63U];
  }
  return text;
}

/// A glTF file in one text: accessors as they are added, and what a test says of the rest.
class GltfText {
 public:
  /// Returns the accessor's number.
  template <class Value>
  int add(const std::string& type, const std::vector<Value>& values, bool is_share = false) {
    const int view = add_view(values);
    accessors_ +=
        fmt::format(R"({}{{"bufferView": {}, "componentType": {}, "type": "{}", "count": {}{}}})",
                    num_accessors_ > 0 ? ", " : "", view, component<Value>(), type,
                    values.size() / components(type), is_share ? R"(, "normalized": true)" : "");
    return num_accessors_++;
  }
  /// An accessor as a test writes it.
  int add_text(const std::string& text) {
    accessors_ += (num_accessors_ > 0 ? ", " : "") + text;
    return num_accessors_++;
  }
  /// more   members of the view
  template <class Value>
  int add_view(const std::vector<Value>& values, const std::string& more = "") {
    while (bytes_.size() % 4 != 0) bytes_ += '\0';
    views_ +=
        fmt::format(R"({}{{"buffer": 0, "byteOffset": {}, "byteLength": {}{}}})",
                    num_views_ > 0 ? ", " : "", bytes_.size(), values.size() * sizeof(Value), more);
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
    return num_views_++;
  }
  /// members   what stands beside asset, buffers, bufferViews and accessors
  std::string text(const std::string& members) const {
    return fmt::format(
        R"({{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": {}, "uri": "data:application/octet-stream;base64,{}"}}], "bufferViews": [{}], "accessors": [{}], {}}})",
        bytes_.size(), base64(bytes_), views_, accessors_, members);
  }

 private:
  template <class Value>
  static int component() {
    if (std::is_same_v<Value, std::int8_t>) return 5120;
    if (std::is_same_v<Value, std::uint8_t>) return 5121;
    if (std::is_same_v<Value, std::int16_t>) return 5122;
    if (std::is_same_v<Value, std::uint16_t>) return 5123;
    return std::is_same_v<Value, std::uint32_t> ? 5125 : 5126;
  }
  static std::size_t components(const std::string& type) {
    return type == "SCALAR" ? 1 : type == "MAT4" ? 16 : static_cast<std::size_t>(type.back() - '0');
  }

  std::string bytes_, views_, accessors_;
  int num_views_ = 0, num_accessors_ = 0;
};

/// Corners of a square of a metre in z = 0, anticlockwise from the origin.
inline const std::vector<float> kSquare = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
inline const std::vector<std::uint16_t> kSquareIndices = {0, 1, 2, 0, 2, 3};

}  // namespace terracast::test
