#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "geo/geodesy.h"

namespace terracast::test {

/// A triangle of a glTF file in the frame of its root, y up.
struct GlbTriangle {
  std::string mesh;
  std::array<Eigen::Vector3d, 3> corners;
};

/// The JSON of a binary glTF, whose lengths must be right (section 4.4).
inline core::Json read_glb_json(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = core::read_file(file, std::size_t{1} << 30);
  std::array<std::uint32_t, 5> words{};
  std::memcpy(words.data(), bytes.data(), sizeof words);
  EXPECT_EQ(words[0], 0x46546C67U);
  EXPECT_EQ(words[2], bytes.size());
  EXPECT_EQ(words[3] % 4, 0U);
  EXPECT_EQ(words[4], 0x4E4F534AU);
  std::array<std::uint32_t, 2> buffer{};
  std::memcpy(buffer.data(), bytes.data() + 20 + words[3], sizeof buffer);
  EXPECT_EQ(20 + words[3] + 8 + buffer[0], bytes.size());
  EXPECT_EQ(buffer[1], 0x004E4942U);
  return core::Json::parse({reinterpret_cast<const char*>(bytes.data()) + 20, words[3]},
                           file.string());
}

/// Where a glTF of ours says that its frame has its origin.
inline geo::Geodetic place_of_glb(const std::filesystem::path& file) {
  const core::Json json = read_glb_json(file);
  const core::Json& extras = json.at("asset").at("extras");
  return {.lat_deg = extras.at("latitude_deg").number(),
          .lon_deg = extras.at("longitude_deg").number(),
          .height_m = extras.at("height_m").number()};
}

/// Reads a binary glTF by its specification alone (Khronos glTF 2.0, sections 3.5 to 3.7 and 4.4):
/// every triangle of every node, moved by the nodes' matrices.
inline std::vector<GlbTriangle> read_glb(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = core::read_file(file, std::size_t{1} << 30);
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return std::size_t{value};
  };
  const std::size_t json_bytes = number(12);
  const core::Json json = core::Json::parse(
      {reinterpret_cast<const char*>(bytes.data()) + 20, json_bytes}, file.string());
  const std::byte* buffer = bytes.data() + 20 + json_bytes + 8;
  const auto view_of = [&](const core::Json& accessor) {
    const core::Json& view =
        json.at("bufferViews").at(static_cast<std::size_t>(accessor.at("bufferView").integer()));
    const auto offset_in = [](const core::Json& of) {
      return of.has("byteOffset") ? of.at("byteOffset").integer() : 0;
    };
    return buffer + offset_in(view) + offset_in(accessor);
  };
  const auto accessor_at = [&](const core::Json& index) -> const core::Json& {
    return json.at("accessors").at(static_cast<std::size_t>(index.integer()));
  };
  std::vector<GlbTriangle> triangles;
  const auto add_mesh = [&](const core::Json& mesh, const Eigen::Matrix4d& root_from_node) {
    for (std::size_t p = 0; p < mesh.at("primitives").size(); ++p) {
      const core::Json& primitive = mesh.at("primitives").at(p);
      const core::Json& places = accessor_at(primitive.at("attributes").at("POSITION"));
      const core::Json& indices = accessor_at(primitive.at("indices"));
      const std::byte* place_bytes = view_of(places);
      const std::byte* index_bytes = view_of(indices);
      const bool is_wide = indices.at("componentType").integer() == 5125;
      const auto corner = [&](std::size_t i) {
        std::size_t index = 0;
        std::memcpy(&index, index_bytes + i * (is_wide ? 4 : 2), is_wide ? 4 : 2);
        Eigen::Vector3f place;
        std::memcpy(place.data(), place_bytes + index * 12, 12);
        return Eigen::Vector3d(
            (root_from_node * place.cast<double>().homogeneous()).template head<3>());
      };
      const auto count = static_cast<std::size_t>(indices.at("count").integer());
      for (std::size_t i = 0; i + 2 < count; i += 3)
        triangles.push_back({mesh.has("name") ? mesh.at("name").string() : "",
                             {corner(i), corner(i + 1), corner(i + 2)}});
    }
  };
  const auto visit = [&](const auto& self, const core::Json& node,
                         const Eigen::Matrix4d& root_from_parent) -> void {
    Eigen::Matrix4d root_from_node = root_from_parent;
    if (node.has("matrix")) {
      const std::vector<double> columns = node.at("matrix").numbers();
      root_from_node *= Eigen::Map<const Eigen::Matrix4d>(columns.data());
    }
    if (node.has("mesh"))
      add_mesh(json.at("meshes").at(static_cast<std::size_t>(node.at("mesh").integer())),
               root_from_node);
    if (!node.has("children")) return;
    for (std::size_t i = 0; i < node.at("children").size(); ++i)
      self(self, json.at("nodes").at(static_cast<std::size_t>(node.at("children").at(i).integer())),
           root_from_node);
  };
  const core::Json& scene = json.at("scenes").at(
      json.has("scene") ? static_cast<std::size_t>(json.at("scene").integer()) : 0);
  for (std::size_t i = 0; i < scene.at("nodes").size(); ++i)
    visit(visit, json.at("nodes").at(static_cast<std::size_t>(scene.at("nodes").at(i).integer())),
          Eigen::Matrix4d::Identity());
  return triangles;
}

}  // namespace terracast::test
