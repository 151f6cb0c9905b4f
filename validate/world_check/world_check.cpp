#include "validate/world_check/world_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "core/hash.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "validate/world_check/ground_check.h"
#include "validate/world_check/shape_check.h"
#include "validate/world_check/shown_together.h"

namespace terracast::world_check {
namespace {

constexpr std::array<std::array<std::string_view, 2>, 17> kKinds = {{
    {"degenerate_face", "triangles without an area"},
    {"coincident_face", "two triangles over the same corners"},
    {"open_mesh", "shapes that are not closed"},
    {"turned_face", "neighbouring triangles that face different ways"},
    {"inside_out", "closed shapes that face inward"},
    {"self_crossing", "closed bodies that meet themselves"},
    {"coincident_solids", "solids that have faces in one plane, over each other"},
    {"twice_in_tile", "an object that a tile holds twice"},
    {"unlike_in_tiles", "an object that is not the same in all tiles"},
    {"missing_in_tile", "a solid that reaches over a tile that does not hold it"},
    {"floating_instance", "instances above the ground"},
    {"floating_building", "buildings whose foot is above the ground"},
    {"paint_under_water", "roads and areas that are painted where water is"},
    {"plant_in_water", "plants of the land in water"},
    {"seagrass_out_of_water", "seagrass on land, or that reaches out of the water"},
    {"plant_on_paint", "plants on roads"},
    {"plant_in_wall", "plants in solids"},
}};

/// Of users' models, which are what they are.
constexpr std::array<std::array<std::string_view, 2>, 2> kInformation = {{
    {"open_model", "users' models that are not closed"},
    {"uneven_model", "users' models with triangles twice, turned against each other or inward"},
}};

/// Of each kind so many faults are told in words.
constexpr std::size_t kMostExamples = 20;

/// Faults of one tile or prototype.
class Tally {
 public:
  void asked(std::string_view kind, std::int64_t count) { of(kind).asked += count; }
  void fault(std::string_view kind, const std::string& what, std::int64_t count = 1) {
    One& one = of(kind);
    if (one.examples.size() < kMostExamples) one.examples.push_back(what);
    one.faults += count;
  }
  void add_to(std::vector<Result>& results) const {
    for (std::size_t k = 0; k < kKinds.size(); ++k) {
      results[k].num_asked += all_[k].asked;
      for (const std::string& example : all_[k].examples)
        if (results[k].examples.size() < kMostExamples) results[k].examples.push_back(example);
      results[k].num_faults += all_[k].faults;
    }
  }

 private:
  struct One {
    std::int64_t asked = 0, faults = 0;
    std::vector<std::string> examples;
  };
  One& of(std::string_view kind) {
    std::size_t k = 0;
    while (kKinds[k][0] != kind) ++k;
    return all_[k];
  }
  std::array<One, kKinds.size()> all_;
};

/// is_model   a user's: only what is left out of models as they are read is wrong there
/// returns    what it has, wrong or not
ShapeFaults check_shape(const world::Shape& shape, const std::string& what, Tally& tally,
                        bool is_model = false) {
  const ShapeFaults faults = find_shape_faults(shape, is_model);
  const auto count = [&](std::string_view kind, std::int64_t asked, std::int64_t found) {
    tally.asked(kind, asked);
    if (found > 0) tally.fault(kind, fmt::format("{}: {}", what, found), found);
  };
  const auto num_triangles = static_cast<std::int64_t>(shape.triangles.size());
  count("degenerate_face", num_triangles, faults.num_degenerate);
  if (is_model) return faults;
  count("coincident_face", num_triangles, faults.num_coincident);
  count("open_mesh", num_triangles, faults.num_open);
  count("turned_face", num_triangles, faults.num_turned);
  count("inside_out", 1, faults.num_inside_out);
  count("self_crossing", faults.num_bodies, faults.num_meeting_themselves);
  return faults;
}

/// Counts users' models of which something can be told.
/// faults   of the finest level of each prototype; nothing: it is no model
std::vector<Result> information_of(const world::WorldManifest& manifest,
                                   const std::vector<std::optional<ShapeFaults>>& faults) {
  std::vector<Result> information;
  for (const auto& [name, meaning] : kInformation)
    information.push_back({.name = name, .meaning = meaning, .examples = {}});
  const auto count = [](Result& result, bool is_found, const std::string& what) {
    ++result.num_asked;
    if (!is_found) return;
    ++result.num_faults;
    if (result.examples.size() < kMostExamples) result.examples.push_back(what);
  };
  for (std::size_t row = 0; row < faults.size(); ++row) {
    if (!faults[row]) continue;
    const ShapeFaults& found = *faults[row];
    const std::string& name = manifest.prototypes[row].name;
    count(information[0], found.num_open > 0,
          fmt::format("model {}: {} open edges", name, found.num_open));
    count(information[1], found.num_coincident + found.num_turned + found.num_inside_out > 0,
          fmt::format("model {}: {} triangles twice, {} edges between triangles that face "
                      "different ways, {} parts that face inward",
                      name, found.num_coincident, found.num_turned, found.num_inside_out));
  }
  return information;
}

/// What a tile holds of an object. A solid is shown by the level of the tile that holds its place, and tiles that
/// meet in a cut differ by one level: so what either of two tiles never shows in the other's presence it may lack.
struct Held {
  std::uint32_t instance_id = 0;
  std::uint32_t tile = 0;  ///< row of the manifest
  bool holds_place = true;
  /// Of all that is shown from the next finer level, the tile's own and the next coarser one on.
  std::array<std::uint64_t, 3> hashes = {};
  bool operator<(const Held& other) const {
    return std::tuple(instance_id, tile, hashes) <
           std::tuple(other.instance_id, other.tile, other.hashes);
  }
};

class Bytes {
 public:
  template <class Value>
  void add(const Value& value) {
    static_assert(std::is_arithmetic_v<Value>);
    const auto* bytes = reinterpret_cast<const char*>(&value);
    text_.append(bytes, sizeof value);
  }
  void add(const Eigen::Vector3i& v) {
    for (int k = 0; k < 3; ++k) add(v[k]);
  }
  void add(const world::Provenance& provenance) {
    add(provenance.layer);
    add(provenance.feature);
  }
  std::uint64_t hash() const { return std::hash<std::string>{}(text_); }

 private:
  std::string text_;
};

/// finest_level   of the tiles by which it is shown
std::uint64_t hash_of(const world::Solid& solid, int finest_level) {
  Bytes bytes;
  bytes.add(solid.provenance);
  bytes.add(solid.place_m.x());
  bytes.add(solid.place_m.y());
  bytes.add(solid.origin_steps);
  for (const world::ShapeLevel& level : solid.levels) {
    if (level.coarsest_level < finest_level) continue;
    bytes.add(level.coarsest_level);
    for (const Eigen::Vector3i& vertex : level.shape.vertices_steps) bytes.add(vertex);
    for (const Eigen::Vector2f& uv : level.shape.uv) {
      bytes.add(uv.x());
      bytes.add(uv.y());
    }
    for (const world::Shape::Triangle& triangle : level.shape.triangles) {
      for (const std::uint32_t corner : triangle.corners) bytes.add(corner);
      bytes.add(triangle.finish);
    }
    for (const world::Finish& finish : level.shape.finishes) {
      bytes.add(static_cast<std::uint8_t>(finish.material));
      bytes.add(static_cast<std::uint8_t>(finish.semantic_class));
      for (const std::uint8_t color : finish.color_srgb) bytes.add(color);
      bytes.add(finish.pattern);
    }
  }
  return bytes.hash();
}

std::uint64_t hash_of(const world::Instance& instance) {
  Bytes bytes;
  bytes.add(instance.provenance);
  bytes.add(instance.prototype);
  bytes.add(instance.place_steps);
  bytes.add(instance.heading);
  bytes.add(instance.scale);
  bytes.add(instance.variety);
  bytes.add(instance.coarsest_level);
  return bytes.hash();
}

/// What one tile tells.
struct TileFacts {
  Tally tally;
  std::vector<Held> held;
  struct Reach {
    std::uint32_t instance_id;
    world::TileId over;
  };
  std::vector<Reach> reaches;  ///< tiles of the same level into whose square solids reach
  std::vector<CoincidentShapes> coincident;
};

/// Tiles beside a solid's own into which its shape reaches by more than a step.
void find_reaches(const world::TileStore& store, const world::TileId& id, const world::Solid& solid,
                  std::vector<TileFacts::Reach>& reaches) {
  const world::Shape* shape = world::shape_at(solid.levels, id.level);
  if (shape == nullptr || shape->vertices_steps.empty()) return;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  for (const Eigen::Vector3i& vertex : shape->vertices_steps) {
    const Eigen::Vector2d at =
        (solid.origin_steps + vertex).head<2>().cast<double>() * world::kHeightStep_m;
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  const Eigen::Vector2d step = Eigen::Vector2d::Constant(world::kHeightStep_m);
  low += step;
  high -= step;
  const world::TileId first = world::tile_at(id.level, low.x(), low.y());
  const world::TileId last = world::tile_at(id.level, high.x(), high.y());
  for (int y = first.y; y <= last.y; ++y)
    for (int x = first.x; x <= last.x; ++x) {
      const world::TileId over{id.level, x, y};
      if (over != id && store.find(over) != nullptr)
        reaches.push_back({solid.provenance.instance_id, over});
    }
}

TileFacts look_at(const world::TileStore& store, const std::vector<PrototypeSize>& sizes,
                  std::uint32_t row) {
  const world::WorldManifest& manifest = store.manifest();
  const world::Tile tile = store.load(manifest.tiles[row].id, world::WaterDepth::Read);
  TileFacts facts;
  for (const world::Solid& solid : tile.objects.solids) {
    const int own = tile.id.level;
    facts.held.push_back(
        {.instance_id = solid.provenance.instance_id,
         .tile = row,
         .holds_place = world::tile_at(own, solid.place_m.x(), solid.place_m.y()) == tile.id,
         .hashes = {hash_of(solid, own - 1), hash_of(solid, own), hash_of(solid, own + 1)}});
    find_reaches(store, tile.id, solid, facts.reaches);
    // In the tile of its place alone.
    if (world::tile_at(tile.id.level, solid.place_m.x(), solid.place_m.y()) != tile.id) continue;
    for (const world::ShapeLevel& level : solid.levels)
      check_shape(level.shape,
                  fmt::format("tile {}: object {}, to level {}", tile.id.name(),
                              solid.provenance.instance_id, level.coarsest_level),
                  facts.tally);
  }
  ShownTogether shown =
      coincident_shapes(tile, [&](const world::TileId& id) { return store.find(id) != nullptr; });
  facts.tally.asked("coincident_solids", shown.num_shapes);
  facts.coincident = std::move(shown.coincident);
  for (const world::Instance& instance : tile.objects.instances) {
    const std::uint64_t hash = hash_of(instance);
    facts.held.push_back({.instance_id = instance.provenance.instance_id,
                          .tile = row,
                          .holds_place = true,
                          .hashes = {hash, hash, hash}});
  }
  check_ground(
      tile, manifest, sizes,
      [&](double x, double y) {
        return world::tile_at(tile.id.level, x, y) == tile.id &&
               (tile.id.level <= manifest.finest_level ||
                store.find(world::tile_at(tile.id.level - 1, x, y)) == nullptr);
      },
      [&](std::string_view kind, const std::string& what) { facts.tally.fault(kind, what); },
      [&](std::string_view kind, std::int64_t count) { facts.tally.asked(kind, count); });
  return facts;
}

void compare_tiles(const world::WorldManifest& manifest, std::vector<Held>& held, Tally& tally) {
  std::sort(held.begin(), held.end());
  tally.asked("twice_in_tile", static_cast<std::int64_t>(held.size()));
  const auto id_of = [&](const Held& one) { return manifest.tiles[one.tile].id; };
  const auto is_unlike = [&](const Held& a, const Held& b) {
    const int level_a = id_of(a).level, level_b = id_of(b).level;
    if (std::abs(level_a - level_b) > 1) return false;
    const int from = a.holds_place == b.holds_place ? std::max(level_a, level_b)
                     : a.holds_place                ? level_a
                                                    : level_b;
    return a.hashes[static_cast<std::size_t>(from - level_a + 1)] !=
           b.hashes[static_cast<std::size_t>(from - level_b + 1)];
  };
  for (std::size_t first = 0, end = 0; first < held.size(); first = end) {
    for (end = first; end < held.size() && held[end].instance_id == held[first].instance_id;) ++end;
    for (std::size_t i = first; i < end; ++i)
      for (std::size_t k = i + 1; k < end; ++k) {
        tally.asked("unlike_in_tiles", 1);
        if (held[i].tile == held[k].tile)
          tally.fault("twice_in_tile", fmt::format("tile {}: object {}", id_of(held[i]).name(),
                                                   held[i].instance_id));
        else if (is_unlike(held[i], held[k]))
          tally.fault("unlike_in_tiles",
                      fmt::format("object {} in tiles {} and {}", held[i].instance_id,
                                  id_of(held[i]).name(), id_of(held[k]).name()));
      }
  }
}

/// Shapes that several tiles find in one plane count once, for the first of these tiles.
/// found   with the tile's row, ascending
void count_coincident(const world::WorldManifest& manifest,
                      const std::vector<std::pair<std::uint32_t, CoincidentShapes>>& found,
                      Tally& tally) {
  std::set<std::tuple<std::uint32_t, std::uint32_t, int, int>> known;
  for (const auto& [row, pair] : found) {
    if (!known.insert(pair.shapes()).second) continue;
    tally.fault(
        "coincident_solids",
        fmt::format("tile {}: objects {} and {}, to levels {} and {}: {:.2f} m2, such as at "
                    "E {:.2f} N {:.2f} m, z {:.2f} m",
                    manifest.tiles[row].id.name(), pair.first_id, pair.second_id, pair.first_level,
                    pair.second_level, pair.area_m2, pair.place_world.x(), pair.place_world.y(),
                    pair.place_world.z()));
  }
}

/// found   how the number of what was found is called
core::Json json_from(const std::vector<Result>& results, std::string_view found) {
  core::Json all = core::Json::array();
  for (const Result& result : results)
    all.push(std::move(core::Json::object()
                           .set("name", result.name)
                           .set("asked", result.num_asked)
                           .set(found, result.num_faults)
                           .set("examples", core::Json::array_of(result.examples))
                           .set("meaning", result.meaning)));
  return all;
}

std::string table_of(std::string_view head, const std::vector<Result>& results) {
  std::string text = fmt::format("{:<20} {:>12} {:>8}  {}\n", head, "asked of", "found", "");
  for (const Result& result : results)
    text += fmt::format(
        "{:<20} {:>12} {:>8}  {}\n", result.name, result.num_asked, result.num_faults,
        result.examples.empty() ? std::string(result.meaning) : result.examples.front());
  return text;
}

}  // namespace

bool WorldFaults::is_right() const {
  return std::all_of(results.begin(), results.end(),
                     [](const Result& result) { return result.num_faults == 0; });
}

WorldFaults check_world(const world::TileStore& store, const core::Context& context) {
  const world::WorldManifest& manifest = store.manifest();
  WorldFaults faults;
  for (const auto& [name, meaning] : kKinds)
    faults.results.push_back({.name = name, .meaning = meaning, .examples = {}});
  const auto num_prototypes = static_cast<std::int64_t>(manifest.prototypes.size());
  std::vector<Tally> of_prototypes(manifest.prototypes.size());
  std::vector<std::optional<ShapeFaults>> of_models(manifest.prototypes.size());
  std::vector<PrototypeSize> sizes(manifest.prototypes.size());
  core::parallel_for(num_prototypes, [&](std::int64_t i) {
    const auto row = static_cast<std::size_t>(i);
    const world::Prototype prototype = store.load_prototype(row);
    sizes[row] = size_of(prototype);
    for (const world::ShapeLevel& level : prototype.levels) {
      const ShapeFaults found = check_shape(
          level.shape,
          fmt::format("prototype {}, to level {}", prototype.name, level.coarsest_level),
          of_prototypes[row], prototype.is_model);
      if (prototype.is_model && !of_models[row]) of_models[row] = found;
    }
  });
  for (const Tally& tally : of_prototypes) tally.add_to(faults.results);
  faults.information = information_of(manifest, of_models);

  std::vector<Held> held;
  std::vector<std::pair<std::uint32_t, TileFacts::Reach>> reaches;
  std::vector<std::pair<std::uint32_t, CoincidentShapes>> coincident;
  core::Progress progress(context, "tiles", static_cast<std::int64_t>(manifest.tiles.size()));
  std::vector<TileFacts> facts(manifest.tiles.size());
  core::parallel_for(static_cast<std::int64_t>(manifest.tiles.size()), [&](std::int64_t i) {
    facts[static_cast<std::size_t>(i)] = look_at(store, sizes, static_cast<std::uint32_t>(i));
    progress.advance();
  });
  for (std::uint32_t row = 0; row < facts.size(); ++row) {
    facts[row].tally.add_to(faults.results);
    held.insert(held.end(), facts[row].held.begin(), facts[row].held.end());
    for (const TileFacts::Reach& reach : facts[row].reaches) reaches.emplace_back(row, reach);
    for (const CoincidentShapes& pair : facts[row].coincident) coincident.emplace_back(row, pair);
    facts[row] = {};
  }
  Tally of_all;
  compare_tiles(manifest, held, of_all);
  count_coincident(manifest, coincident, of_all);
  std::map<world::TileId, std::uint32_t> rows;
  for (std::uint32_t row = 0; row < manifest.tiles.size(); ++row)
    rows[manifest.tiles[row].id] = row;
  for (const auto& [from, reach] : reaches) {
    of_all.asked("missing_in_tile", 1);
    const Held wanted{.instance_id = reach.instance_id, .tile = rows.at(reach.over)};
    const auto found = std::lower_bound(held.begin(), held.end(), wanted);
    if (found == held.end() || found->instance_id != wanted.instance_id ||
        found->tile != wanted.tile)
      of_all.fault("missing_in_tile",
                   fmt::format("object {} of tile {} reaches over tile {}", reach.instance_id,
                               manifest.tiles[from].id.name(), reach.over.name()));
  }
  of_all.add_to(faults.results);
  return faults;
}

core::Json json_from(const WorldFaults& faults, const world::WorldManifest& manifest) {
  core::Json layers = core::Json::array();
  for (const world::LayerInfo& layer : manifest.layers) {
    core::Json counts = core::Json::object();
    for (const auto& [name, count] : layer.counts) counts.set(name, count);
    layers.push(std::move(core::Json::object()
                              .set("name", layer.name)
                              .set("kind", layer.kind)
                              .set("counts", std::move(counts))));
  }
  return std::move(core::Json::object()
                       .set("ok", faults.is_right())
                       .set("world", manifest.name)
                       .set("results", json_from(faults.results, "faults"))
                       .set("information", json_from(faults.information, "found"))
                       .set("layers", std::move(layers)));
}

std::string table_of(const WorldFaults& faults, const world::WorldManifest& manifest) {
  std::string text =
      table_of("fault", faults.results) + table_of("information", faults.information);
  for (const world::LayerInfo& layer : manifest.layers) {
    text += fmt::format("layer {} ({})\n", layer.name, layer.kind);
    for (const auto& [name, count] : layer.counts)
      text += fmt::format("  {:<40} {:>12}\n", name, count);
  }
  return text;
}

}  // namespace terracast::world_check
