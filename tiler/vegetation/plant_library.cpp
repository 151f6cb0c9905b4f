#include "tiler/vegetation/plant_library.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <span>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tiler/vegetation/blue_noise.h"
#include "tiler/vegetation/species.h"
#include "world/tile_id.h"

namespace terracast::tiler {
namespace {

using world::Shape;

constexpr int kNumClumpVarieties = 2;
constexpr std::uint64_t kClumpSeed = 0x636c756d70ULL;
/// Cells of the trees of a clump; its trees are 1.4 times as far apart.
constexpr double kClumpCell_m = 3.0;
/// Crowns of a piece of forest are made so wide that together they cover this share of its ground, as the
/// trees do that it stands for; what hangs over its border is counted.
constexpr double kDenseCover = 0.98;
constexpr double kOpenCover = 0.55;
/// But no wider than this.
constexpr double kWidestCrown_m = 5.4;
/// Level and triangles of trees in clumps of each size.
constexpr int kTreeTriangles[kNumClumpSizes] = {60, 20, 12};

/// Shares of species in a forest; they add up to 1.
struct Share {
  std::string_view species;
  double share;
};

std::span<const Share> mix_of(ForestKind kind) {
  static const std::vector<Share> mixes[kNumForestKinds] = {
      {{"oak", 0.65}, {"birch", 0.3}, {"poplar", 0.05}},
      {{"spruce", 0.92}, {"birch", 0.08}},
      {{"pine", 0.85}, {"oak", 0.15}},
      {{"oak", 0.35}, {"spruce", 0.4}, {"birch", 0.15}, {"pine", 0.1}}};
  return mixes[static_cast<std::size_t>(kind)];
}

struct Extents {
  double height_m = 0.0;
  double reach_m = 0.0;
  double sunk_m = 0.0;  ///< by that shape which is sunk least
  double root_reach_m = 0.0;
};

Extents extents_of(const world::ShapeLevels& levels) {
  Extents extents;
  for (const world::ShapeLevel& level : levels) {
    double sunk_m = 0.0;
    for (const Eigen::Vector3i& vertex : level.shape.vertices_steps) {
      const double side_m = vertex.head<2>().cast<double>().norm() * world::kHeightStep_m;
      extents.height_m = std::max(extents.height_m, vertex.z() * world::kHeightStep_m);
      extents.reach_m = std::max(extents.reach_m, side_m);
      if (vertex.z() >= 0) continue;
      sunk_m = std::max(sunk_m, -vertex.z() * world::kHeightStep_m);
      extents.root_reach_m = std::max(extents.root_reach_m, side_m);
    }
    extents.sunk_m = &level == &levels.front() ? sunk_m : std::min(extents.sunk_m, sunk_m);
  }
  return extents;
}

/// Adds a turned and scaled shape.
/// scale   along x, y and along z
void add_shape(Shape& all, const Shape& one, const Eigen::Vector3d& place_m, double heading_rad,
               const Eigen::Vector2d& scale, double sunk_m) {
  const Eigen::Matrix3d turned =
      Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::vector<std::uint8_t> finish_rows;
  for (const world::Finish& finish : one.finishes) {
    const auto found = std::find(all.finishes.begin(), all.finishes.end(), finish);
    finish_rows.push_back(static_cast<std::uint8_t>(found - all.finishes.begin()));
    if (found == all.finishes.end()) all.finishes.push_back(finish);
  }
  const auto first = static_cast<std::uint32_t>(all.vertices_steps.size());
  for (const Eigen::Vector3i& vertex : one.vertices_steps) {
    const Eigen::Vector3d scaled =
        vertex.cast<double>().cwiseProduct(Eigen::Vector3d(scale.x(), scale.x(), scale.y()));
    Eigen::Vector3d at = turned * scaled * world::kHeightStep_m + place_m;
    if (vertex.z() < 0) at.z() -= sunk_m;
    all.vertices_steps.emplace_back(
        (at / world::kHeightStep_m).array().round().cast<int>().matrix());
  }
  for (const Shape::Triangle& triangle : one.triangles)
    all.triangles.push_back(
        {{triangle.corners[0] + first, triangle.corners[1] + first, triangle.corners[2] + first},
         finish_rows[triangle.finish]});
}

/// Of all that a prototype is.
std::string hash_of(const world::Prototype& prototype) {
  std::string all = prototype.name;
  for (const world::ShapeLevel& level : prototype.levels) {
    std::vector<std::uint32_t> numbers = {static_cast<std::uint32_t>(level.coarsest_level)};
    for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
      for (const int step : vertex) numbers.push_back(static_cast<std::uint32_t>(step));
    for (const Shape::Triangle& triangle : level.shape.triangles) {
      numbers.insert(numbers.end(), triangle.corners.begin(), triangle.corners.end());
      numbers.push_back(triangle.finish);
    }
    for (const world::Finish& finish : level.shape.finishes) {
      numbers.push_back(static_cast<std::uint32_t>(finish.material));
      numbers.push_back(static_cast<std::uint32_t>(finish.semantic_class));
      numbers.insert(numbers.end(), finish.color_srgb.begin(), finish.color_srgb.end());
    }
    all += core::content_hash(std::as_bytes(std::span(numbers)));
  }
  return core::content_hash(all);
}

struct Variety {
  const SpeciesInfo* species;
  int number;
  world::ShapeLevels levels;
  double height_m = 0.0;
  Shape coarse[kNumClumpSizes];  ///< in clumps; of trees only
  double coarse_reach_m[kNumClumpSizes];
};

/// All that the trees of clumps are taken from, by row of all_species().
using Varieties = std::vector<std::vector<Variety>>;

bool is_in_clumps(const SpeciesInfo& species) {
  for (int kind = 0; kind < kNumForestKinds; ++kind)
    for (const Share& share : mix_of(static_cast<ForestKind>(kind)))
      if (share.species == species.name) return true;
  return false;
}

Varieties grow_all() {
  Varieties all;
  std::vector<Variety*> rows;
  for (const SpeciesInfo& species : all_species()) {
    all.emplace_back();
    for (int number = 0; number < species.num_varieties; ++number)
      all.back().push_back({&species, number, {}, 0.0, {}, {}});
  }
  for (std::vector<Variety>& varieties : all)
    for (Variety& variety : varieties) rows.push_back(&variety);
  core::parallel_for(static_cast<std::int64_t>(rows.size()), [&](std::int64_t i) {
    Variety& variety = *rows[static_cast<std::size_t>(i)];
    const Plant plant = grow_variety(*variety.species, variety.number);
    variety.levels = levels_of(plant, variety.species->levels);
    variety.height_m = extents_of(variety.levels).height_m;
    if (!is_in_clumps(*variety.species)) return;
    const double full_area_m2 = seen_area_m2(full_mesh(plant));
    for (int size = 0; size < kNumClumpSizes; ++size) {
      variety.coarse[size] = mesh_of(plant, kTreeTriangles[size], full_area_m2);
      variety.coarse_reach_m[size] = extents_of({{0, variety.coarse[size]}}).reach_m;
    }
  });
  return all;
}

/// The trees of a piece of forest.
/// detail    of the trees' shapes: a size of clumps
/// crown_m   mean radius of their crowns
Shape clump_of(const Varieties& varieties, ForestKind kind, int size, int detail, bool is_open,
               double top_m, std::uint64_t number, double crown_m) {
  const double side_m = clump_side_m(size);
  const std::uint64_t stream = core::stream_of(kClumpSeed, number);
  const auto unit = [&](std::uint64_t tree, std::uint64_t what) {
    return core::random_unit(kClumpSeed, core::stream_of(stream, what), tree);
  };
  const Eigen::Vector2d corner(core::random_unit(kClumpSeed, stream, 0) * 1024.0,
                               core::random_unit(kClumpSeed, stream, 1) * 1024.0);
  const std::vector<BlueNoise::Place> places =
      BlueNoise(kClumpSeed, 0, kClumpCell_m)
          .places_in(corner, corner + Eigen::Vector2d::Constant(side_m));
  Shape shape;
  for (std::size_t i = 0; i < places.size(); ++i) {
    // The first stands in any case: no piece of forest is empty.
    if (is_open && i > 0 && i % 2 == 1) continue;
    double drawn = unit(i, 2);
    const std::span<const Share> mix = mix_of(kind);
    const Share* share = &mix.front();
    for (const Share& other : mix) {
      share = &other;
      if ((drawn -= other.share) < 0.0) break;
    }
    const std::vector<Variety>& of_species = varieties[species_row(share->species)];
    const Variety& variety =
        of_species[static_cast<std::size_t>(unit(i, 3) * static_cast<double>(of_species.size()))];
    const double height_m = top_m * (0.78 + 0.30 * unit(i, 4));
    const Eigen::Vector2d at =
        places[i].at_world - corner - Eigen::Vector2d::Constant(0.5 * side_m);
    const double upward = height_m / variety.height_m;
    add_shape(shape, variety.coarse[detail], {at.x(), at.y(), 0.0},
              2.0 * std::numbers::pi * unit(i, 5),
              {crown_m * (0.8 + 0.4 * unit(i, 6)) / variety.coarse_reach_m[detail], upward},
              0.3 * side_m);
  }
  return shape;
}

Shape clump_shape(const Varieties& varieties, ForestKind kind, int size, int detail, bool is_open,
                  double top_m, std::uint64_t number) {
  const double area_m2 =
      clump_side_m(size) * clump_side_m(size) * (is_open ? kOpenCover : kDenseCover);
  const auto with = [&](double crown_m) {
    return clump_of(varieties, kind, size, detail, is_open, top_m, number, crown_m);
  };
  double smallest = 1.0;
  double largest = kWidestCrown_m / 1.2;
  for (int i = 0; i < 6; ++i) {
    const double middle = 0.5 * (smallest + largest);
    (plan_area_m2(with(middle)) < area_m2 ? smallest : largest) = middle;
  }
  return with(smallest);
}

}  // namespace

std::shared_ptr<const PlantLibrary> PlantLibrary::grown() {
  // Kept while anybody uses it: worlds of one process share it.
  static std::mutex mutex;
  static std::weak_ptr<const PlantLibrary> kept;
  const std::lock_guard lock(mutex);
  std::shared_ptr<const PlantLibrary> library = kept.lock();
  if (!library) {
    library.reset(new PlantLibrary());
    kept = library;
  }
  return library;
}

PlantLibrary::PlantLibrary() {
  const Varieties varieties = grow_all();
  for (const std::vector<Variety>& of_species : varieties) {
    species_.emplace_back();
    for (const Variety& variety : of_species) {
      const Extents extents = extents_of(variety.levels);
      species_.back().push_back({static_cast<std::uint16_t>(prototypes_.size()), extents.height_m,
                                 extents.reach_m, variety.levels.back().coarsest_level,
                                 extents.sunk_m, extents.root_reach_m});
      prototypes_.push_back(
          {fmt::format("{}_{}", variety.species->name, variety.number), variety.levels});
    }
  }
  constexpr const char* kNames[kNumForestKinds] = {"broadleaf", "conifer", "pine", "mixed"};
  struct Clump {
    ForestKind kind;
    int size;
    bool is_open;
    double top_m;
    int variety;
    world::Prototype prototype;
  };
  std::vector<Clump> clumps;
  for (int kind = 0; kind < kNumForestKinds; ++kind)
    for (int size = 0; size < kNumClumpSizes; ++size)
      for (const bool is_open : {false, true})
        for (const double top_m : kClumpHeights_m)
          for (int variety = 0; variety < kNumClumpVarieties; ++variety)
            clumps.push_back({static_cast<ForestKind>(kind), size, is_open, top_m, variety, {}});
  core::parallel_for(static_cast<std::int64_t>(clumps.size()), [&](std::int64_t i) {
    Clump& clump = clumps[static_cast<std::size_t>(i)];
    clump.prototype.name = fmt::format("{}{}_forest_{:g}m_{:g}m_{}", clump.is_open ? "open_" : "",
                                       kNames[static_cast<std::size_t>(clump.kind)],
                                       clump_side_m(clump.size), clump.top_m, clump.variety);
    // On finer tiles the trees themselves are shown.
    clump.prototype.levels.push_back(
        {static_cast<std::int8_t>(kFinestClumpLevel + clump.size - 1), Shape{}});
    for (int k = 0; k < std::min(2, kNumClumpSizes - clump.size); ++k)
      clump.prototype.levels.push_back(
          {static_cast<std::int8_t>(kFinestClumpLevel + clump.size + k),
           clump_shape(varieties, clump.kind, clump.size, clump.size + k, clump.is_open,
                       clump.top_m, static_cast<std::uint64_t>(i + 1))});
  });
  for (Clump& clump : clumps) {
    if (clump.variety == 0) clumps_.emplace_back();
    clumps_.back().push_back({static_cast<std::uint16_t>(prototypes_.size()), clump.top_m,
                              extents_of(clump.prototype.levels).reach_m,
                              clump.prototype.levels.back().coarsest_level});
    prototypes_.push_back(std::move(clump.prototype));
  }
  std::string hashes;
  for (const world::Prototype& prototype : prototypes_) hashes += hash_of(prototype);
  content_hash_ = core::content_hash(hashes);
}

const std::vector<PlantModel>& PlantLibrary::of(std::string_view species) const {
  return species_[species_row(species)];
}

const std::vector<PlantModel>& PlantLibrary::clumps(ForestKind kind, int size, bool is_open,
                                                    double height_m) const {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < kClumpHeights_m.size(); ++i)
    if (height_m * height_m > kClumpHeights_m[i - 1] * kClumpHeights_m[i]) nearest = i;
  const std::size_t row =
      ((static_cast<std::size_t>(kind) * kNumClumpSizes + static_cast<std::size_t>(size)) * 2 +
       (is_open ? 1 : 0)) *
          kClumpHeights_m.size() +
      nearest;
  return clumps_[row];
}

}  // namespace terracast::tiler
