#include "export/world/tile_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <unordered_map>

#include "core/error.h"
#include "core/stop.h"
#include "world/instance_frame.h"

namespace terracast::world_export {
namespace {

using world::kHeightStep_m;
using world::kTileCells;
using world::Tile;
using world::TileId;

struct CoverLook {
  std::string_view name;
  std::array<std::uint8_t, 3> color_srgb;
};
/// By world::Cover.
constexpr std::array<CoverLook, world::kNumCovers> kCoverLooks = {{
    {"land", {142, 132, 104}},
    {"sea", {38, 78, 112}},
    {"outside", {130, 126, 112}},
    {"forest", {58, 84, 46}},
    {"shrubs", {104, 112, 68}},
    {"grass", {112, 130, 70}},
    {"crops", {158, 146, 84}},
    {"built_up", {146, 142, 136}},
    {"bare", {150, 140, 126}},
    {"snow", {236, 240, 244}},
    {"wetland", {92, 104, 74}},
    {"lake", {44, 88, 116}},
    {"river", {56, 92, 108}},
    {"seabed", {120, 112, 88}},
}};

Part& part_of(std::map<std::string, Part>& parts, const std::string& name,
              const std::array<std::uint8_t, 3>& color_srgb, int texture) {
  const auto [found, is_new] = parts.try_emplace(name);
  if (is_new) {
    found->second.name = name;
    found->second.color_srgb = color_srgb;
    found->second.texture = texture;
  }
  return found->second;
}

/// A shape's parts, by finish. Alike finishes are one part, their vertices shared where they share
/// places.
/// textures   null: colours alone
std::vector<Part> parts_of(const world::Shape& shape, ModelTextures* textures) {
  std::map<std::string, Part> parts;
  std::map<std::string, std::unordered_map<std::uint32_t, std::uint32_t>> own_vertices;
  for (const world::Shape::Triangle& triangle : shape.triangles) {
    const world::Finish& finish = shape.finishes[triangle.finish];
    const std::string_view class_name =
        core::semantic_class_names()[static_cast<std::size_t>(finish.semantic_class)];
    const auto& c = finish.color_srgb;
    const int texture = textures != nullptr && !shape.uv.empty() ? textures->of(finish) : -1;
    std::string name = fmt::format("{}_{}_{:02x}{:02x}{:02x}", class_name,
                                   static_cast<int>(finish.material), c[0], c[1], c[2]);
    if (texture >= 0) name += fmt::format("_texture{}", finish.pattern);
    Part& part = part_of(parts, name, c, texture);
    auto& own = own_vertices[name];
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [found, is_new] =
          own.try_emplace(triangle.corners[k], static_cast<std::uint32_t>(part.vertices.size()));
      if (is_new) {
        part.vertices.push_back(shape.vertices_steps[triangle.corners[k]].cast<double>() *
                                kHeightStep_m);
        if (texture >= 0) part.uv.push_back(shape.uv[triangle.corners[k]]);
      }
      corners[k] = found->second;
    }
    part.triangles.push_back(corners);
  }
  std::vector<Part> result;
  for (auto& [name, part] : parts) result.push_back(std::move(part));
  return result;
}

void append(std::map<std::string, Part>& parts, const std::vector<Part>& added,
            const Eigen::Vector3d& origin_world, const geo::Rigid3d& frame_from_world) {
  for (const Part& from : added) {
    Part& part = part_of(parts, from.name, from.color_srgb, from.texture);
    const auto first = static_cast<std::uint32_t>(part.vertices.size());
    for (const Eigen::Vector3d& vertex : from.vertices)
      part.vertices.push_back(frame_from_world * (origin_world + vertex));
    part.uv.insert(part.uv.end(), from.uv.begin(), from.uv.end());
    for (const auto& corners : from.triangles)
      part.triangles.push_back({first + corners[0], first + corners[1], first + corners[2]});
  }
}

struct Corner {
  int i;
  int j;
};

/// Adds triangles of a tile's ground to the parts of their covers.
class GroundParts {
 public:
  /// texture   the tile's picture, or -1
  GroundParts(const TileGround& ground, int texture, const geo::Rigid3d& frame_from_world,
              std::map<std::string, Part>& parts)
      : ground_(ground), texture_(texture), frame_from_world_(frame_from_world), parts_(parts) {}

  void add(const Corner& a, const Corner& b, const Corner& c) {
    const world::Cover cover = ground_.cover(a.i, a.j);
    Part& part = part_of_cover(cover);
    part.triangles.push_back(
        {vertex(part, cover, a), vertex(part, cover, b), vertex(part, cover, c)});
  }

  /// The tile's four sides, downward.
  void add_skirt(double depth_m) {
    const auto side = [&](auto&& corner_at) {
      for (int k = 0; k < kTileCells; ++k) add_skirt_cell(corner_at(k), corner_at(k + 1), depth_m);
    };
    side([](int k) { return Corner{k, 0}; });
    side([](int k) { return Corner{kTileCells, k}; });
    side([](int k) { return Corner{kTileCells - k, kTileCells}; });
    side([](int k) { return Corner{0, kTileCells - k}; });
  }

 private:
  /// A part of its own for each picture.
  Part& part_of_cover(world::Cover cover) {
    const auto [found, is_new] = part_of_.try_emplace(cover, nullptr);
    if (is_new) {
      const TileId& id = ground_.tile().id;
      std::string name(cover_name(cover));
      if (texture_ >= 0) name += fmt::format("_{}_{}_{}", id.level, id.x, id.y);
      // The picture has the ground's colours.
      constexpr std::array<std::uint8_t, 3> kWhite = {255, 255, 255};
      found->second =
          &part_of(parts_, name, texture_ >= 0 ? kWhite : ground_color_srgb(cover), texture_);
    }
    return *found->second;
  }
  void push(Part& part, const Corner& at, double below_m) {
    const Eigen::Vector3d place = ground_.vertex_world(at.i, at.j);
    part.vertices.push_back(frame_from_world_ * (place - Eigen::Vector3d(0.0, 0.0, below_m)));
    if (texture_ >= 0)
      part.uv.push_back(Eigen::Vector2f(static_cast<float>(at.i), static_cast<float>(at.j)) /
                        static_cast<float>(kTileCells));
  }
  std::uint32_t vertex(Part& part, world::Cover cover, const Corner& at) {
    const auto [found, is_new] = index_.try_emplace(
        std::tuple(cover, at.i, at.j), static_cast<std::uint32_t>(part.vertices.size()));
    if (is_new) push(part, at, 0.0);
    return found->second;
  }
  void add_skirt_cell(const Corner& a, const Corner& b, double depth_m) {
    Part& part = part_of_cover(ground_.cover(a.i, a.j));
    const auto first = static_cast<std::uint32_t>(part.vertices.size());
    for (const Corner& at : {a, b})
      for (const double below_m : {0.0, depth_m}) push(part, at, below_m);
    // Seen from outside: a and b from left to right, their feet below.
    part.triangles.push_back({first, first + 1, first + 2});
    part.triangles.push_back({first + 2, first + 1, first + 3});
  }

  const TileGround& ground_;
  const int texture_;
  const geo::Rigid3d& frame_from_world_;
  std::map<std::string, Part>& parts_;
  std::map<world::Cover, Part*> part_of_;
  std::map<std::tuple<world::Cover, int, int>, std::uint32_t> index_;
};

Eigen::Matrix4d frame_from_model(const world::Instance& instance, const geo::WorldFrame& frame,
                                 const geo::Rigid3d& frame_from_world) {
  const world::InstanceFrame place = world::instance_frame(instance, frame);
  Eigen::Matrix4d result = Eigen::Matrix4d::Identity();
  result.topLeftCorner<3, 3>() =
      place.scale * (frame_from_world.rotation * place.world_from_prototype).toRotationMatrix();
  result.topRightCorner<3, 1>() = frame_from_world * place.place_world;
  return result;
}

std::size_t num_triangles_of(const std::vector<Part>& parts) {
  std::size_t sum = 0;
  for (const Part& part : parts) sum += part.triangles.size();
  return sum;
}

}  // namespace

std::array<std::uint8_t, 3> ground_color_srgb(world::Cover cover) {
  return kCoverLooks[static_cast<std::size_t>(cover)].color_srgb;
}

std::string_view cover_name(world::Cover cover) {
  return kCoverLooks[static_cast<std::size_t>(cover)].name;
}

std::size_t WorldModel::num_triangles() const {
  std::size_t sum = num_triangles_of(parts);
  for (const Placed& one : placed) sum += num_triangles_of(prototypes[one.model]);
  return sum;
}

ModelMaker::ModelMaker(const world::TileStore& store, bool has_pictures)
    : store_(store), frame_(store.manifest().origin) {
  if (has_pictures) baker_.emplace(store);
  for (std::size_t row = 0; row < store.manifest().prototypes.size(); ++row)
    prototypes_.push_back(store.load_prototype(row));
}

WorldModel ModelMaker::make(const std::vector<world::CutTile>& cut,
                            const geo::Rigid3d& frame_from_world,
                            const ModelOptions& options) const {
  const auto is_wanted = [&](const Eigen::Vector3d& place_world) {
    return !options.region || (is_in_square(store_.manifest(), place_world.head<2>()) &&
                               options.region->contains(frame_.geodetic_from_world(place_world)));
  };
  TERRACAST_CHECK(baker_ || options.texture_side_px == 0, "pictures of {} pixels without a baker",
                  options.texture_side_px);
  std::map<std::string, Part> parts;
  WorldModel model;
  std::vector<std::size_t> prototype_triangles;
  std::size_t num_placed_triangles = 0;
  ModelTextures all_textures(store_);
  ModelTextures* const textures = options.texture_side_px > 0 ? &all_textures : nullptr;
  std::map<std::pair<std::size_t, const world::Shape*>, std::size_t> model_of;
  for (const world::CutTile& cut_tile : cut) {
    core::throw_if_stop_asked();
    const TileGround ground(store_.load(cut_tile.id), cut_tile.coarser_sides);
    const Tile& tile = ground.tile();
    const int picture =
        textures != nullptr ? textures->add_ground(*baker_, ground, options.texture_side_px) : -1;
    GroundParts ground_parts(ground, picture, frame_from_world, parts);
    for (int j = 0; j < kTileCells; ++j)
      for (int i = 0; i < kTileCells; ++i) {
        const Eigen::Vector3d middle =
            0.5 * (ground.vertex_world(i + 1, j) + ground.vertex_world(i, j + 1));
        if (!is_wanted(middle)) continue;
        ground_parts.add({i, j}, {i + 1, j}, {i, j + 1});
        ground_parts.add({i + 1, j + 1}, {i, j + 1}, {i + 1, j});
      }
    if (options.skirt_m > 0.0) ground_parts.add_skirt(options.skirt_m);

    // An object stands in every tile over which it reaches; here it counts in that of its place.
    const int level = tile.id.level;
    for (const world::Solid& solid : tile.objects.solids) {
      const Eigen::Vector2d place_m = solid.place_m.cast<double>();
      const world::Shape* shape = world::shape_at(solid.levels, level);
      if (shape == nullptr || world::tile_at(level, place_m.x(), place_m.y()) != tile.id) continue;
      const Eigen::Vector3d origin_world = solid.origin_steps.cast<double>() * kHeightStep_m;
      if (is_wanted(origin_world))
        append(parts, parts_of(*shape, textures), origin_world, frame_from_world);
    }
    for (const world::Instance& instance : tile.objects.instances) {
      const Eigen::Vector3d place_world = instance.place_steps.cast<double>() * kHeightStep_m;
      if (world::tile_at(level, place_world.x(), place_world.y()) != tile.id) continue;
      if (level > instance.coarsest_level || !is_wanted(place_world)) continue;
      const world::Shape* shape = world::shape_at(prototypes_[instance.prototype].levels, level);
      if (shape == nullptr) continue;
      const auto [found, is_new] =
          model_of.try_emplace(std::pair(instance.prototype, shape), model.prototypes.size());
      if (is_new) {
        model.prototypes.push_back(parts_of(*shape, textures));
        prototype_triangles.push_back(num_triangles_of(model.prototypes.back()));
      }
      num_placed_triangles += prototype_triangles[found->second];
      model.placed.push_back({found->second, frame_from_model(instance, frame_, frame_from_world)});
    }
    std::size_t num_triangles = num_placed_triangles;
    for (const auto& [name, part] : parts) num_triangles += part.triangles.size();
    if (num_triangles > kMostTriangles)
      core::fail(core::ErrorKind::Input,
                 "more than {} triangles, which is what a file holds; give a smaller --region or a "
                 "coarser --spacing",
                 kMostTriangles);
    if (options.progress != nullptr) options.progress->advance();
  }
  for (auto& [name, part] : parts) model.parts.push_back(std::move(part));
  model.textures = all_textures.take();
  return model;
}

}  // namespace terracast::world_export
