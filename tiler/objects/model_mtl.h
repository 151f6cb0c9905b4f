#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "core/ledger.h"
#include "tiler/objects/model_folder.h"

namespace terracast::tiler {

/// The picture of a material's map_Kd, and the options before its name.
struct MtlPicture {
  std::string name;
  std::filesystem::path file;
  Eigen::Vector2d scale = Eigen::Vector2d::Ones();
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();
  bool repeats = true;

  /// Where a corner's vt lies on the picture.
  Eigen::Vector2d place_of(const Eigen::Vector2d& vt) const {
    return scale.cwiseProduct(vt) + offset;
  }
};

/// A material of a library (.mtl).
struct MtlMaterial {
  std::optional<Eigen::Array3d> kd_srgb;
  std::optional<MtlPicture> picture;
  bool is_see_through = false;
};

/// Reads a library into materials by name; one of a name that there is already takes its place.
/// folder_of_library   in the model's folder, to which its pictures are relative; else to the model's
/// throws              Input: a picture that leads out of the model's folder
void read_mtl(std::span<const std::byte> bytes, const std::filesystem::path& folder_of_library,
              const ModelFolder& folder, std::map<std::string, MtlMaterial>& materials,
              core::Ledger& ledger);

/// Statements that it knows.
std::span<const core::KnownName> mtl_names();

}  // namespace terracast::tiler
