#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/semantic_class.h"
#include "export/world/ground_baker.h"
#include "export/world/model_textures.h"
#include "export/world/region.h"
#include "geo/rigid3.h"
#include "world/tile_store.h"

namespace terracast::world_export {

/// More make files that other programs choke on.
inline constexpr std::size_t kMostTriangles = 40'000'000;

/// Triangles of one look.
struct Part {
  std::string name;  ///< class, and material where several share the class
  std::array<std::uint8_t, 3> color_srgb = {128, 128, 128};  ///< multiplies the texture
  int texture = -1;                       ///< of WorldModel::textures; -1: the colour alone
  std::vector<Eigen::Vector3d> vertices;  ///< m, in the frame asked for
  std::vector<Eigen::Vector2f> uv;  ///< of each vertex, (0, 0) lower left; none without a texture
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from outside
};

/// Something that stands in several places.
struct Placed {
  std::size_t model = 0;  ///< of WorldModel::prototypes
  Eigen::Matrix4d frame_from_model = Eigen::Matrix4d::Identity();
};

/// Part of a world in one frame.
struct WorldModel {
  std::vector<Part> parts;
  std::vector<std::vector<Part>> prototypes;  ///< each with its parts in its own frame
  std::vector<Placed> placed;
  std::vector<ModelTexture> textures;

  std::size_t num_triangles() const;
};

/// What a model is made of.
struct ModelOptions {
  /// Only triangles whose centres, and objects whose places, lie within and in the world's square; none: whole tiles.
  std::optional<Region> region;
  double skirt_m = 0.0;  ///< hung from the terrain's border, against gaps to coarser neighbours
  /// Of each tile's picture of its ground; 0: none, and models without textures.
  int texture_side_px = 0;
  core::Progress* progress = nullptr;  ///< of the tiles; null: nobody wants to know
};

/// Ground and objects of tiles as the ray caster meets them: stitched triangles, and each object in
/// the level of detail that its place's tile gives it, once.
/// throws   Input, Io: from tiles
class ModelMaker {
 public:
  /// has_pictures   of the ground and of models' textures: ModelOptions::texture_side_px may be above 0
  /// throws         Input, Io: as GroundBaker where it has
  ModelMaker(const world::TileStore& store, bool has_pictures);

  /// cut               tiles that together cover what is shown
  /// frame_from_world  of the vertices
  /// throws            Input, Io: as GroundBaker; Input: more than kMostTriangles, as soon as tiles read hold them
  WorldModel make(const std::vector<world::CutTile>& cut, const geo::Rigid3d& frame_from_world,
                  const ModelOptions& options) const;

 private:
  const world::TileStore& store_;
  geo::WorldFrame frame_;
  std::vector<world::Prototype> prototypes_;
  std::optional<GroundBaker> baker_;  ///< none: nothing is pictured
};

/// Colour of a class of ground where nothing else is known.
std::array<std::uint8_t, 3> ground_color_srgb(world::Cover cover);
std::string_view cover_name(world::Cover cover);

}  // namespace terracast::world_export
