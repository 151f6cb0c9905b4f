#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/ledger.h"

namespace terracast::tiler {

/// An image that a model's materials name.
struct ModelImage {
  std::string name;            ///< as the model has it
  std::filesystem::path file;  ///< in the model's folder; empty: the bytes lie in the model
  std::vector<std::byte> bytes;
};

/// How a surface looks: factor x image x colour of its vertices, all in linear light.
struct ModelMaterial {
  Eigen::Array3d factor = Eigen::Array3d::Ones();
  /// In the factor's place where the image cannot be read.
  Eigen::Array3d factor_without_image = Eigen::Array3d::Ones();
  std::optional<std::size_t> image = {};  ///< of ModelScene::images
  /// Colours of vertices stand beside the image, not for it.
  bool tints_image = true;
  bool shows_through = false;  ///< the image's alpha is no mere fourth channel
  bool repeats = true;         ///< the image goes on beyond its edges by repeating
  bool is_metal = false;
};

/// Triangles of one material, in the file's own axes and units.
struct ModelPart {
  std::string name;  ///< for messages
  std::size_t material = 0;
  std::vector<Eigen::Vector3d> places = {};
  std::vector<Eigen::Vector2f> uv =
      {};  ///< of each place, or none; from the image's lower left corner
  std::vector<Eigen::Array3f> colors = {};                   ///< of each place, or none; linear
  std::vector<std::array<std::uint32_t, 3>> triangles = {};  ///< anticlockwise seen from outside
};

/// What a model's file says, before it is brought to a world's lattice.
struct ModelScene {
  std::vector<ModelImage> images;
  std::vector<ModelMaterial> materials;
  std::vector<ModelPart> parts;
  std::map<std::string, std::int64_t> counts;  ///< what was repaired or left out
  core::Ledger ledger;
};

/// sRGB's transfer function, of a value 0 … 1.
double linear_from_srgb(double value);
Eigen::Array3d linear_from_srgb(const Eigen::Array3d& color);

/// What stands for a colour that an OBJ or PLY does not state.
inline constexpr double kNoColor_srgb = 0.6;

}  // namespace terracast::tiler
