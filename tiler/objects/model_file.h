#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "core/ledger.h"
#include "core/schema.h"
#include "world/shape.h"
#include "world/texture.h"

namespace terracast::tiler {

/// Config keys of a model.
struct ModelOptions {
  std::string name;
  core::Path file;
  std::string semantic_class = "object";
  std::string up = "y";
  std::string origin = "foot";
  double unit_m = 1.0;
  double yaw_deg = 0.0;

  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// A thing read from a file.
struct Model {
  world::Prototype prototype;
  std::vector<world::Texture> textures;  ///< of Material::Textured
  Eigen::Vector2d footprint_m = Eigen::Vector2d::Zero();
  std::string content_hash;  ///< of the file, all that it names, and the options
  std::vector<std::pair<std::string, std::int64_t>> counts;  ///< what was repaired or left out
  core::Ledger ledger;  ///< what its file says, as model_tables() know it
};

/// Bounds on what a model may hold.
inline constexpr std::uint64_t kMostModelTriangles = 2'000'000;
inline constexpr std::uint64_t kMostModelBytes = std::uint64_t{1} << 30;
/// Triangulating a face that is not convex takes the square of its corners.
inline constexpr unsigned kMostFaceCorners = 1000;

/// Reads glTF 2 (.gltf, .glb), OBJ or PLY, as model_gltf.h, model_obj.h and model_ply.h say. A colour is factor x picture x
/// colour of vertices, multiplied in linear light; of the last, which is one for a triangle, the mean. Coarser levels
/// are made by clustering vertices in cells of a quarter of the spacing of the tiles that show them.
/// Repaired and counted: triangles without area on the lattice, textures that are missing or of a kind that is not read
/// (their material's colour stands for them), what has no surface, colours that are merged as a shape has at most 256.
/// texture_bytes_left   that its textures may take in memory, coarser levels included; less what they do take
/// throws   Io: no such file; Config: another kind of file; Input: glTF 1, extensions that it requires and
///          that are not known, paths that lead out of its folder, files or numbers that do not fit together,
///          vertices that are no numbers, no triangle, or more than the bounds (of OBJ those of obj_check.h, too);
///          Interrupted: a stop was asked for
Model read_model(const ModelOptions& options, std::uint64_t& texture_bytes_left);

/// What the readers of models know.
std::vector<core::KnownTable> model_tables();

}  // namespace terracast::tiler
