#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "core/instance_id.h"
#include "core/random.h"
#include "geo/units.h"
#include "tiler/grid.h"
#include "tiler/layer.h"
#include "tiler/shown_ground.h"
#include "tiler/surface.h"
#include "tiler/vegetation/blue_noise.h"
#include "tiler/vegetation/canopy.h"
#include "tiler/vegetation/crop_rows.h"
#include "tiler/vegetation/fields.h"
#include "tiler/vegetation/habitat.h"
#include "tiler/vegetation/plant_library.h"
#include "tiler/world_options.h"

// Plants and stones. All is a pure function of place: places are strewn by BlueNoise, each decides by
// itself what stands on it, and is known by the number of its cell.
//
// Tiles of the levels up to 2 hold each tree. On coarser ones a forest of 4 km would be 600 000 trees of
// two pixels: there pieces of forest stand for their trees (PlantLibrary::clumps), as wide as the tile's
// terrain samples are apart, at most 65 536 of them on a tile. Which cells are such pieces is decided
// for each of the three sizes by the cell's own ground; a tree whose cell of 8 m is one is not shown beyond
// level 2, others are, so that no hole opens where levels meet.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::Cover;

/// Bumped when what stands where changes.
constexpr int kVegetationVersion = 5;

/// What is strewn, each kind by cells of its own.
enum Stratum : std::size_t { kTallTrees, kLowTrees, kBushes, kPlants, kStones, kNumStrata };
struct StratumInfo {
  double cell_m;
  int coarsest_level;  ///< of tiles on which any of it is shown
  double reach_m;      ///< nothing of it reaches farther from its place
};
constexpr std::array<StratumInfo, kNumStrata> kStrata = {{
    {5.0, 4, 20.0},  // tall trees, 7 m apart
    {2.5, 2, 20.0},  // trees below and between them, 3.5 m apart
    {3.0, 2, 5.0},
    {3.0, 1, 5.0},
    {10.0, 3, 8.0},
}};
constexpr int kCropLevel = 2;
constexpr double kCropReach_m = 4.0;

/// Low trees keep so far from tall ones.
constexpr double kTreeDistance_m = 3.5;
/// Trees of forests are shown one by one up to this level.
constexpr int kTreeLevel = 2;
/// Beyond it, of trees that stand alone those are shown that would do so if so few of their places bore
/// any; on meadows and in gardens these are nearly all.
constexpr double kLoneShare = 0.12;
/// Stones and bushes keep so far from stems.
constexpr double kStemDistance_m = 1.5;

/// A cell's ground is forest where so many of its places bear trees.
constexpr double kForestShare = 0.3;
/// With more it is a dense one.
constexpr double kDenseShare = 0.62;

/// Trees below tall ones are smaller.
constexpr double kLowShare = 0.72;
/// No species is drawn larger than this.
constexpr double kLargestTree = 1.9;
/// A canopy lower than this is one of bushes.
constexpr double kTallestBush_m = 3.5;
/// Of forest in good places.
constexpr double kBroadleafTop_m = 16.0;
constexpr double kConiferTop_m = 22.0;
/// Broadleaved forest has fewer conifers than this.
constexpr double kMixedShare = 0.3;

constexpr int kFinestTile = -3;
/// Tiles beside a tile of a cut differ from it by a level, those at its corners by two.
constexpr int kLevelsAtCorner = 2;
constexpr int kCoarsestClumpLevel = kFinestClumpLevel + kNumClumpSizes - 1;
/// Pieces of forest are drawn so much smaller or larger at most.
constexpr double kSmallestClump = 0.7;
constexpr double kLargestClump = 1.3;
/// How far a piece of forest reaches from its middle: to its corner, where a crown goes on.
constexpr double clump_reach_m(int size) {
  return kLargestClump * (0.5 * std::numbers::sqrt2 * clump_side_m(size) + 5.5);
}

/// No crops where the ground rises more than this: pieces of fields are level.
constexpr double kSteepestField = 0.18;
constexpr double kSteepestMeadow = 0.45;

/// Ground's facts are taken at nodes so far apart and interpolated.
constexpr double kFactNode_m = 32.0;

/// Numbers drawn for a place.
enum Draw : std::uint64_t { kTake, kKind, kVariety, kSize, kHeading, kColour, kShare };

constexpr std::uint32_t kIdBit = 0x80000000U;

/// Numbers cells of the world's square, kind after kind: the ids of what stands in them.
class CellNumbers {
 public:
  explicit CellNumbers(double size_m) : half_size_m_(0.5 * size_m) {
    std::uint64_t first = 0;
    for (const double cell_m : kCells_m) {
      // A cell more on either side, for places on the border.
      const auto side = static_cast<std::uint64_t>(std::ceil(size_m / cell_m)) + 2;
      ranges_.push_back({first, side});
      first += side * side;
    }
    if (first > core::kFirstMovingId - kIdBit) {
      double per_m2 = 0.0;
      for (const double cell_m : kCells_m) per_m2 += 1.0 / (cell_m * cell_m);
      core::fail(
          core::ErrorKind::Config,
          "vegetation can tell its plants apart in worlds of up to {:.0f} km, and size_m = {} "
          "is more; make the world smaller, or leave the layer out",
          std::floor(std::sqrt((core::kFirstMovingId - kIdBit) / per_m2) / 1000.0), size_m);
    }
  }

  std::uint32_t id(std::size_t kind, std::int32_t cell_x, std::int32_t cell_y) const {
    const Range& range = ranges_[kind];
    const auto offset = static_cast<std::int64_t>(std::floor(half_size_m_ / kCells_m[kind])) + 1;
    const auto x = static_cast<std::uint64_t>(cell_x + offset);
    const auto y = static_cast<std::uint64_t>(cell_y + offset);
    TERRACAST_CHECK(x < range.side && y < range.side, "cell {}/{} of {}", cell_x, cell_y, kind);
    return kIdBit | static_cast<std::uint32_t>(range.first + y * range.side + x);
  }

  static constexpr std::size_t kCrops = kNumStrata;
  static constexpr std::size_t kClumps = kNumStrata + 1;  ///< and one for each larger size

 private:
  static constexpr std::array<double, kNumStrata + 1 + kNumClumpSizes> kCells_m = {
      kStrata[0].cell_m, kStrata[1].cell_m, kStrata[2].cell_m, kStrata[3].cell_m, kStrata[4].cell_m,
      Fields::kCell_m,   clump_side_m(0),   clump_side_m(1),   clump_side_m(2)};

  struct Range {
    std::uint64_t first;
    std::uint64_t side;
  };
  double half_size_m_;
  std::vector<Range> ranges_;
};

struct Box {
  Vector2d lowest;
  Vector2d highest;

  Box grown(double by_m) const { return {lowest.array() - by_m, highest.array() + by_m}; }
  bool encloses(const Box& other) const {
    return (lowest.array() <= other.lowest.array()).all() &&
           (highest.array() >= other.highest.array()).all();
  }
};

/// A place on the border belongs to what lies east or north of it.
bool contains(const Box& box, const Vector2d& place_world) {
  return (place_world.array() >= box.lowest.array()).all() &&
         (place_world.array() < box.highest.array()).all();
}

std::int32_t clump_cell(double at, int size) {
  return static_cast<std::int32_t>(std::floor(at / clump_side_m(size)));
}
Vector2d clump_center(int size, std::int32_t x, std::int32_t y) {
  return clump_side_m(size) * Vector2d(x + 0.5, y + 0.5);
}

Box box_of(const world::TileId& id) {
  const Vector2d corner = id.corner_world();
  return {corner, corner + Vector2d::Constant(id.side_m())};
}

/// Places of a box by square cells, for asking what is near.
class NearPlaces {
 public:
  /// box   holds all places that are added
  NearPlaces(double cell_m, const Box& box)
      : cell_m_(cell_m),
        lowest_(box.lowest),
        last_(cell(box.highest.x() - lowest_.x()) + 1, cell(box.highest.y() - lowest_.y()) + 1,
              kNone) {}

  void add(const Vector2d& at) {
    std::int32_t& last = last_(cell(at.x() - lowest_.x()), cell(at.y() - lowest_.y()));
    places_.push_back({at, last});
    last = static_cast<std::int32_t>(places_.size() - 1);
  }
  /// distance_m   at most cell_m
  bool has_within(const Vector2d& at, double distance_m) const {
    const int x = cell(at.x() - lowest_.x());
    const int y = cell(at.y() - lowest_.y());
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, last_.height - 1); ++j)
      for (int i = std::max(x - 1, 0); i <= std::min(x + 1, last_.width - 1); ++i)
        for (std::int32_t k = last_(i, j); k != kNone;
             k = places_[static_cast<std::size_t>(k)].before)
          if ((places_[static_cast<std::size_t>(k)].at_world - at).squaredNorm() <
              distance_m * distance_m)
            return true;
    return false;
  }

 private:
  static constexpr std::int32_t kNone = -1;
  struct Place {
    Vector2d at_world;
    std::int32_t before;  ///< another of the same cell
  };
  int cell(double from_lowest_m) const {
    return static_cast<int>(std::floor(from_lowest_m / cell_m_));
  }

  double cell_m_;
  Vector2d lowest_;
  Grid<std::int32_t> last_;  ///< of each cell, in places_
  std::vector<Place> places_;
};

class VegetationLayer;

/// What is computed once for a tile and asked often; all of it follows from place alone.
class TileWork {
 public:
  TileWork(const VegetationLayer& layer, const world::TileId& id, const LayerSite& site,
           world::TileObjects& objects);
  void add_all();

 private:
  /// How a cell of 8, 16 or 32 m is shown where its level says so.
  struct Piece {
    bool is_forest = false;
    bool is_blocked = false;  ///< it would be forest, but others hold some of it
    bool is_open = false;
    ForestKind kind = ForestKind::Mixed;
    double scale = 1.0;
    double foot_z_world = 0.0;  ///< of forest
    const PlantModel* model = nullptr;
  };

  /// Of the ground at a node, taken when asked for.
  struct Facts {
    double z_world = std::numeric_limits<double>::quiet_NaN();
    double height_m = 0.0;
    double moisture = 0.0;
  };

  /// What a place is like, and how much grows there.
  struct Here {
    Vector2d place_world;
    Ground ground;
    bool is_garden = false;
    std::optional<double> canopy_m{};
    Growth growth{};
  };

  const Facts& facts(int i, int j);
  Ground ground(const Vector2d& place_world);
  Here here(const Vector2d& place_world);
  TreeKinds tree_kinds(const Here& here) const;
  const Piece& piece(int size, std::int32_t x, std::int32_t y);
  Piece make_piece(int size, std::int32_t x, std::int32_t y);

  struct Strewn {
    Box box;
    std::vector<BlueNoise::Place> places;
  };

  /// Places of a box; those of the tile, or along a side of it, and some metres round them are strewn once.
  std::vector<BlueNoise::Place> places_in(Stratum stratum, const Box& box);
  /// The box and what else is asked for in the tile or along the same side.
  Box most_asked_with(const Box& box) const;

  /// Boxes in which places of something are to be looked at that is shown on tiles of some levels: the
  /// tile and what reaches into it, or only the latter where the tile's own level shows nothing of it.
  std::vector<Box> boxes(int finest_level, int coarsest_level, double reach_m) const;

  void add_trees(Stratum stratum);
  void add_bushes();
  void add_plants();
  void add_stones();
  void add_crops();
  void add_clumps(int size);
  void add_clump(int size, std::int32_t x, std::int32_t y, const Box& box, int last_level);

  int last_level_on_land(const Vector2d& place_world, double foot_z_world, int first_level,
                         int last_level) const;

  std::uint32_t clump_id(int size, std::int32_t x, std::int32_t y) const;
  bool is_lone(Stratum stratum, const BlueNoise::Place& place);
  void add_tree(Stratum stratum, const BlueNoise::Place& place);
  /// first_level   finest of those whose tiles may lack the ground below it
  void add(std::uint32_t id, const PlantModel& model, const Eigen::Vector3d& foot_world,
           std::uint16_t heading, double scale, int coarsest_level, int first_level = 0);
  void add(std::uint32_t id, const PlantModel& model, const Vector2d& place_world,
           std::uint16_t heading, double scale, int coarsest_level) {
    add(id, model,
        Eigen::Vector3d(place_world.x(), place_world.y(), site_.ground_z_world(place_world)),
        heading, scale, coarsest_level);
  }

  const VegetationLayer& layer_;
  world::TileId id_;
  const LayerSite& site_;
  world::TileObjects& objects_;
  Box box_;
  int first_node_x_;
  int first_node_y_;
  Grid<Facts> facts_;
  std::array<std::unordered_map<std::uint64_t, Piece>, kNumClumpSizes> pieces_;
  std::array<std::vector<Strewn>, kNumStrata> strewn_;
};

class VegetationLayer final : public Layer {
 public:
  VegetationLayer(const LayerInputs& inputs, const core::Path& canopy, const std::string& nodata)
      : frame_(inputs.frame),
        surface_(inputs.surface),
        seed_(core::stream_of(inputs.seed, 0x7665676574ULL)),
        half_size_m_(0.5 * inputs.size_m),
        library_(PlantLibrary::grown()),
        numbers_(inputs.size_m),
        habitat_(seed_, inputs.surface.options().origin_lat_deg),
        fields_(world::FieldPattern(
            static_cast<std::uint64_t>(inputs.surface.options().seed),
            world::FieldPattern::grows_vines(inputs.surface.options().origin_lat_deg))) {
    for (const auto& earlier : inputs.earlier)
      if (dynamic_cast<const VegetationLayer*>(earlier.get()) != nullptr)
        core::fail(
            core::ErrorKind::Config,
            "a world has one layer of kind vegetation, and this is its second; put both into "
            "one: it follows all layers' land cover, and one canopy");
    for (const ForestKind kind :
         {ForestKind::Broadleaf, ForestKind::Conifer, ForestKind::Pine, ForestKind::Mixed})
      for (int size = 0; size < kNumClumpSizes; ++size)
        for (const double top_m : {5.0, 10.0, 16.0, 30.0})
          for (const PlantModel& model : library_->clumps(kind, size, false, top_m))
            TERRACAST_CHECK(kLargestClump * model.reach_m <= clump_reach_m(size), "{} m",
                            model.reach_m);
    for (const std::string_view species : {"oak", "birch", "poplar", "spruce", "pine", "palm"})
      for (const PlantModel& model : library_->of(species))
        TERRACAST_CHECK(kLargestTree * model.reach_m <= kStrata[kTallTrees].reach_m, "{} {} m",
                        species, model.reach_m);
    const auto& layers = inputs.surface.options().layers;
    for (std::size_t i = 0; i < inputs.earlier.size() && i < layers.size(); ++i)
      if (layers[i].kind == "buildings") houses_.push_back(inputs.earlier[i].get());
    for (std::size_t k = 0; k < kNumStrata; ++k) strewn_.emplace_back(seed_, k, kStrata[k].cell_m);
    if (!canopy.empty()) {
      canopy_ = Canopy::open(canopy, nodata, surface_, inputs.size_m);
      canopy_name_ = std::filesystem::path(canopy.written).filename().string();
    }
  }

  world::LayerInfo info() const override {
    world::LayerInfo info;
    info.source = canopy_ ? canopy_name_ : "procedural";
    info.content_hash = canopy_ ? canopy_->content_hash() : library_->content_hash();
    if (canopy_)
      info.counts = {{"canopy samples", canopy_->num_samples()},
                     {"canopy samples without a height", canopy_->num_voids()},
                     {"canopy samples with trees", canopy_->num_wooded()}};
    return info;
  }

  std::string input_hash() const override {
    return core::content_hash(fmt::format("vegetation {} {} {} {}", kVegetationVersion, seed_,
                                          library_->content_hash(),
                                          canopy_ ? canopy_->content_hash() : ""));
  }

  std::span<const world::Prototype> prototypes() const override { return library_->prototypes(); }

  void add_objects(const world::TileId& id, const LayerSite& site,
                   world::TileObjects& objects) const override {
    if (id.level > kCoarsestClumpLevel + kLevelsAtCorner) return;
    TileWork(*this, id, site, objects).add_all();
  }

  /// Whether a house stands near by.
  bool is_garden(const Vector2d& place_world) const {
    constexpr double kGarden_m = 17.0;
    return std::any_of(houses_.begin(), houses_.end(),
                       [&](const Layer* layer) { return layer->holds(place_world, kGarden_m); });
  }

  const geo::WorldFrame& frame_;
  const WorldSurface& surface_;
  std::uint64_t seed_;
  double half_size_m_;
  std::shared_ptr<const PlantLibrary> library_;
  CellNumbers numbers_;
  Habitat habitat_;
  Fields fields_;
  std::vector<const Layer*> houses_;  ///< layers of buildings
  std::vector<BlueNoise> strewn_;
  std::unique_ptr<Canopy> canopy_;
  std::string canopy_name_;
};

TileWork::TileWork(const VegetationLayer& layer, const world::TileId& id, const LayerSite& site,
                   world::TileObjects& objects)
    : layer_(layer), id_(id), site_(site), objects_(objects), box_(box_of(id)) {
  const Box reached = box_.grown(2.0 * clump_side_m(kNumClumpSizes - 1));
  const auto node = [](double at) { return static_cast<int>(std::floor(at / kFactNode_m)); };
  // Places beyond the world's square bear nothing.
  const double half_m = layer.half_size_m_;
  const Vector2d lowest = reached.lowest.cwiseMax(-half_m).cwiseMin(half_m);
  const Vector2d highest = reached.highest.cwiseMax(-half_m).cwiseMin(half_m);
  first_node_x_ = node(lowest.x());
  first_node_y_ = node(lowest.y());
  facts_ =
      Grid<Facts>(node(highest.x()) - first_node_x_ + 2, node(highest.y()) - first_node_y_ + 2);
}

const TileWork::Facts& TileWork::facts(int i, int j) {
  Facts& facts = facts_(std::clamp(i, 0, facts_.width - 1), std::clamp(j, 0, facts_.height - 1));
  if (!std::isnan(facts.z_world)) return facts;
  const double half_m = layer_.half_size_m_;
  const double x = std::clamp((first_node_x_ + i) * kFactNode_m, -half_m, half_m);
  const double y = std::clamp((first_node_y_ + j) * kFactNode_m, -half_m, half_m);
  const SurfaceSample sample = layer_.surface_.sample(x, y);
  facts.z_world = sample.z_world;
  // The tangent plane leaves the ellipsoid with the square of the distance.
  facts.height_m = sample.z_world + (x * x + y * y) / (2.0 * geo::kWgs84SemiMajorAxis_m);
  facts.moisture = sample.moisture / 255.0;
  return facts;
}

Ground TileWork::ground(const Vector2d& place_world) {
  const double x = place_world.x() / kFactNode_m - first_node_x_;
  const double y = place_world.y() / kFactNode_m - first_node_y_;
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const double tx = x - i;
  const double ty = y - j;
  const Facts& sw = facts(i, j);
  const Facts& se = facts(i + 1, j);
  const Facts& nw = facts(i, j + 1);
  const Facts& ne = facts(i + 1, j + 1);
  const auto between = [&](double Facts::*value) {
    const double south = sw.*value + tx * (se.*value - sw.*value);
    const double north = nw.*value + tx * (ne.*value - nw.*value);
    return south + ty * (north - south);
  };
  const double rise_east_m =
      (1.0 - ty) * (se.z_world - sw.z_world) + ty * (ne.z_world - nw.z_world);
  const double rise_north_m =
      (1.0 - tx) * (nw.z_world - sw.z_world) + tx * (ne.z_world - se.z_world);
  return {.cover = site_.cover(place_world),
          .height_m = between(&Facts::height_m),
          .slope = std::hypot(rise_east_m, rise_north_m) / kFactNode_m,
          .moisture = between(&Facts::moisture)};
}

/// Covers between which woods and meadows may stray.
bool has_soft_edges(Cover cover) {
  return cover == Cover::Forest || cover == Cover::Land || cover == Cover::Shrubs ||
         cover == Cover::Grass || cover == Cover::Bare;
}

TileWork::Here TileWork::here(const Vector2d& place_world) {
  Here here{.place_world = place_world, .ground = ground(place_world)};
  if (has_soft_edges(here.ground.cover)) {
    const Cover beside = site_.cover(layer_.habitat_.strayed(place_world));
    if (has_soft_edges(beside)) here.ground.cover = beside;
  }
  here.growth = layer_.habitat_.growth(here.ground, place_world);
  here.is_garden = here.ground.cover == Cover::Grass && layer_.is_garden(place_world);
  if (here.is_garden) layer_.habitat_.plant_garden(here.growth);
  if (layer_.canopy_) here.canopy_m = layer_.canopy_->height_m(place_world);
  if (here.canopy_m) {
    here.growth.trees = *here.canopy_m >= kLowestTree_m ? 1.0 : 0.0;
    if (here.growth.trees == 1.0) here.growth.bushes *= 0.3;
  }
  return here;
}

TreeKinds TileWork::tree_kinds(const Here& here) const {
  TreeKinds kinds = layer_.habitat_.tree_kinds(here.ground, here.place_world);
  if (here.is_garden) layer_.habitat_.plant_garden(kinds);
  if (here.canopy_m) kinds.dead = 0.0;
  return kinds;
}

std::vector<Box> TileWork::boxes(int finest_level, int coarsest_level, double reach_m) const {
  const Box outer = box_.grown(reach_m);
  if (id_.level >= finest_level && id_.level <= coarsest_level) return {outer};
  const int apart = std::max(finest_level - id_.level, id_.level - coarsest_level);
  if (apart > kLevelsAtCorner) return {};
  if (apart == kLevelsAtCorner) {
    std::vector<Box> corners;
    for (const bool is_north : {false, true})
      for (const bool is_east : {false, true})
        corners.push_back({{is_east ? box_.highest.x() : outer.lowest.x(),
                            is_north ? box_.highest.y() : outer.lowest.y()},
                           {is_east ? outer.highest.x() : box_.lowest.x(),
                            is_north ? outer.highest.y() : box_.lowest.y()}});
    return corners;
  }
  return {{outer.lowest, {outer.highest.x(), box_.lowest.y()}},
          {{outer.lowest.x(), box_.highest.y()}, outer.highest},
          {{outer.lowest.x(), box_.lowest.y()}, {box_.lowest.x(), box_.highest.y()}},
          {{box_.highest.x(), box_.lowest.y()}, {outer.highest.x(), box_.highest.y()}}};
}

std::vector<BlueNoise::Place> TileWork::places_in(Stratum stratum, const Box& box) {
  const double half_m = layer_.half_size_m_;
  const auto in_square = [&](const Box& all) {
    return Box{all.lowest.cwiseMax(-half_m), all.highest.cwiseMin(half_m)};
  };
  std::vector<Strewn>& known = strewn_[stratum];
  auto found = std::find_if(known.begin(), known.end(),
                            [&](const Strewn& strewn) { return strewn.box.encloses(box); });
  if (found == known.end()) {
    const Box most = most_asked_with(box);
    TERRACAST_CHECK(most.encloses(box), "tile {}", id_.name());
    const Box part = in_square(most);
    found = known.insert(known.end(),
                         {most, layer_.strewn_[stratum].places_in(part.lowest, part.highest)});
  }
  std::vector<BlueNoise::Place> places;
  for (const BlueNoise::Place& place : found->places)
    if (contains(box, place.at_world)) places.push_back(place);
  return places;
}

Box TileWork::most_asked_with(const Box& box) const {
  constexpr double kOutward_m = kStrata[kTallTrees].reach_m + 2.0 * kTreeDistance_m;
  constexpr double kInward_m = 2.0 * kTreeDistance_m;
  const auto goes_along = [&](int axis) {
    return box.lowest[axis] <= box_.lowest[axis] && box.highest[axis] >= box_.highest[axis];
  };
  Box most = box_.grown(kOutward_m);
  if (!goes_along(0) && !goes_along(1)) return box;
  for (const int axis : {0, 1}) {
    if (goes_along(axis)) continue;
    if (box.lowest[axis] < box_.lowest[axis])
      most.highest[axis] = box_.lowest[axis] + kInward_m;
    else
      most.lowest[axis] = box_.highest[axis] - kInward_m;
  }
  return most;
}

void TileWork::add_all() {
  const double half_m = layer_.half_size_m_;
  const Box reached = box_.grown(kStrata[kTallTrees].reach_m);
  if (reached.lowest.maxCoeff() >= half_m || reached.highest.minCoeff() <= -half_m) return;
  add_trees(kTallTrees);
  add_trees(kLowTrees);
  add_bushes();
  add_plants();
  add_stones();
  add_crops();
  for (int size = 0; size < kNumClumpSizes; ++size) add_clumps(size);
}

std::uint64_t cell_key(std::int32_t x, std::int32_t y) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32U |
         static_cast<std::uint32_t>(x);
}

/// Numbers of a place: a pure function of its id.
struct PlaceDraws {
  std::uint64_t seed;
  std::uint32_t id;

  double unit(Draw draw) const { return core::random_unit(seed, draw, id); }
  std::uint64_t bits(Draw draw) const { return core::random_bits(seed, draw, id); }
  std::uint16_t heading() const { return static_cast<std::uint16_t>(bits(kHeading)); }
  const PlantModel& variety(const std::vector<PlantModel>& models) const {
    return models[static_cast<std::size_t>(unit(kVariety) * static_cast<double>(models.size()))];
  }
};

/// The last of some levels of which all have dry ground there, or the one before the first.
int TileWork::last_level_on_land(const Vector2d& place_world, double foot_z_world, int first_level,
                                 int last_level) const {
  const int last =
      last_level_with_ground(site_, place_world, foot_z_world, first_level, last_level);
  // What grows has more room than samples of finer tiles are apart.
  for (int level = std::max(first_level, 0); level <= last; ++level)
    if (is_amid_water(site_, place_world, level)) return level - 1;
  return last;
}

void TileWork::add(std::uint32_t id, const PlantModel& model, const Eigen::Vector3d& foot_world,
                   std::uint16_t heading, double scale, int coarsest_level, int first_level) {
  world::Instance instance;
  instance.provenance.instance_id = id;
  instance.provenance.feature = id;
  instance.prototype = model.prototype;
  instance.place_steps =
      (foot_world / world::kHeightStep_m).array().round().cast<std::int32_t>().matrix();
  instance.heading = heading;
  instance.scale = static_cast<std::uint16_t>(std::clamp(std::lround(scale * 4096.0), 1L, 65535L));
  instance.variety = static_cast<std::uint8_t>(core::random_bits(layer_.seed_, kColour, id));
  instance.coarsest_level =
      static_cast<std::int8_t>(last_level_on_land(foot_world.head<2>(), foot_world.z(), first_level,
                                                  std::min(coarsest_level, model.coarsest_level)));
  objects_.instances.push_back(instance);
}

bool is_inside(const Vector2d& place_world, double half_size_m) {
  return place_world.cwiseAbs().maxCoeff() < half_size_m;
}

std::string_view species_of(const TreeKinds& kinds, double drawn) {
  const double broadleaves =
      std::max(1.0 - kinds.dead - kinds.palms - kinds.conifers - kinds.pines, 0.0);
  const std::array<std::pair<double, std::string_view>, 7> shares = {
      {{kinds.dead, "dead_tree"},
       {kinds.palms, "palm"},
       {kinds.conifers, "spruce"},
       {kinds.pines, "pine"},
       {broadleaves * kinds.poplars, "poplar"},
       {broadleaves * 0.34, "birch"},
       {broadleaves, "oak"}}};
  double sum = 0.0;
  for (const auto& [share, name] : shares) {
    sum += share;
    if (drawn < sum) return name;
  }
  return kinds.conifers > 0.5 ? "spruce" : "oak";
}

void TileWork::add_trees(Stratum stratum) {
  const StratumInfo& info = kStrata[stratum];
  const bool is_low = stratum == kLowTrees;
  for (const Box& box : boxes(kFinestTile, info.coarsest_level, info.reach_m)) {
    const Box wider = box.grown(kTreeDistance_m);
    NearPlaces tall(kTreeDistance_m, wider);
    if (is_low) {
      for (const BlueNoise::Place& place : places_in(kTallTrees, wider)) tall.add(place.at_world);
    }
    for (const BlueNoise::Place& place : places_in(stratum, box)) {
      if (!is_inside(place.at_world, layer_.half_size_m_)) continue;
      if (tall.has_within(place.at_world, kTreeDistance_m)) continue;
      if (id_.level > kTreeLevel && contains(box_, place.at_world) && !is_lone(stratum, place))
        continue;
      add_tree(stratum, place);
    }
  }
}

/// Whether a tree that stands there is shown on coarse tiles.
bool TileWork::is_lone(Stratum stratum, const BlueNoise::Place& place) {
  if (stratum != kTallTrees) return false;
  const PlaceDraws draws{layer_.seed_, layer_.numbers_.id(stratum, place.cell_x, place.cell_y)};
  return draws.unit(kTake) < kLoneShare &&
         !piece(0, clump_cell(place.at_world.x(), 0), clump_cell(place.at_world.y(), 0)).is_forest;
}

void TileWork::add_tree(Stratum stratum, const BlueNoise::Place& place) {
  const PlaceDraws draws{layer_.seed_, layer_.numbers_.id(stratum, place.cell_x, place.cell_y)};
  const Here here = this->here(place.at_world);
  if (draws.unit(kTake) >= here.growth.trees) return;
  const bool is_low = stratum == kLowTrees;
  const std::optional<double>& canopy_m = here.canopy_m;
  const TreeKinds kinds = tree_kinds(here);

  const PlantLibrary& library = *layer_.library_;
  const PlantModel* model = nullptr;
  double scale = 0.0;
  const auto is_free_as = [&](std::string_view species, double smaller) {
    model = &draws.variety(library.of(species));
    scale = canopy_m ? *canopy_m / model->height_m
                     : smaller * kinds.size * (0.75 + 0.4 * draws.unit(kSize)) *
                           (is_low ? kLowShare : 1.0);
    return scale <= kLargestTree && site_.is_free(place.at_world, scale * model->reach_m);
  };
  const std::string_view species = species_of(kinds, draws.unit(kKind));
  // Beside walls, water and roads the crown has less room: a smaller tree, or, where its height is
  // known, a slimmer one.
  const bool is_free =
      canopy_m && *canopy_m < kTallestBush_m ? is_free_as("bush", 1.0)
      : canopy_m ? is_free_as(species, 1.0) || is_free_as("birch", 1.0) || is_free_as("poplar", 1.0)
                 : is_free_as(species, 1.0) || is_free_as(species, 0.5);
  if (!is_free) return;
  const int coarsest_level = is_lone(stratum, place) ? kStrata[stratum].coarsest_level : kTreeLevel;
  add(draws.id, *model, place.at_world, draws.heading(), scale, coarsest_level);
}

void TileWork::add_bushes() {
  const StratumInfo& info = kStrata[kBushes];
  for (const Box& box : boxes(kFinestTile, info.coarsest_level, info.reach_m)) {
    const Box wider = box.grown(kStemDistance_m);
    NearPlaces stems(kStemDistance_m, wider);
    for (const Stratum stratum : {kTallTrees, kLowTrees})
      for (const BlueNoise::Place& place : places_in(stratum, wider)) stems.add(place.at_world);
    for (const BlueNoise::Place& place : places_in(kBushes, box)) {
      if (!is_inside(place.at_world, layer_.half_size_m_)) continue;
      const PlaceDraws draws{layer_.seed_, layer_.numbers_.id(kBushes, place.cell_x, place.cell_y)};
      const Here here = this->here(place.at_world);
      if (draws.unit(kTake) >= here.growth.bushes) continue;
      if (here.growth.trees > kForestShare && stems.has_within(place.at_world, kStemDistance_m))
        continue;
      const bool is_dwarf = draws.unit(kKind) < here.growth.dwarf_pines;
      const PlantModel& model =
          draws.variety(layer_.library_->of(is_dwarf ? "mountain_pine" : "bush"));
      const double scale = 0.45 + 0.75 * draws.unit(kSize) * (0.5 + 0.5 * tree_kinds(here).size);
      if (!site_.is_free(place.at_world, scale * model.reach_m)) continue;
      add(draws.id, model, place.at_world, draws.heading(), scale, scale < 0.75 ? 1 : 2);
    }
  }
}

void TileWork::add_plants() {
  const StratumInfo& info = kStrata[kPlants];
  for (const Box& box : boxes(kFinestTile, info.coarsest_level, info.reach_m))
    for (const BlueNoise::Place& place : places_in(kPlants, box)) {
      if (!is_inside(place.at_world, layer_.half_size_m_)) continue;
      const PlaceDraws draws{layer_.seed_, layer_.numbers_.id(kPlants, place.cell_x, place.cell_y)};
      const Here here = this->here(place.at_world);
      const double drawn = draws.unit(kTake);
      const bool is_reed = drawn < here.growth.reeds;
      if (!is_reed && drawn >= here.growth.reeds + here.growth.grass) continue;
      if (here.ground.slope > kSteepestMeadow) continue;
      const PlantModel& model = draws.variety(layer_.library_->of(is_reed ? "reed" : "grass"));
      if (id_.level - kLevelsAtCorner > model.coarsest_level) continue;
      const double scale = 0.75 + 0.5 * draws.unit(kSize);
      if (!site_.is_free(place.at_world, scale * model.reach_m)) continue;
      add(draws.id, model, place.at_world, draws.heading(), scale, model.coarsest_level);
    }
}

void TileWork::add_stones() {
  const StratumInfo& info = kStrata[kStones];
  for (const Box& box : boxes(kFinestTile, info.coarsest_level, info.reach_m)) {
    const Box wider = box.grown(kStemDistance_m);
    NearPlaces stems(kStemDistance_m, wider);
    for (const BlueNoise::Place& place : places_in(kTallTrees, wider)) stems.add(place.at_world);
    for (const BlueNoise::Place& place : places_in(kStones, box)) {
      if (!is_inside(place.at_world, layer_.half_size_m_)) continue;
      const PlaceDraws draws{layer_.seed_, layer_.numbers_.id(kStones, place.cell_x, place.cell_y)};
      const Here here = this->here(place.at_world);
      if (draws.unit(kTake) >= here.growth.boulders) continue;
      if (here.growth.trees > 0.0 && stems.has_within(place.at_world, kStemDistance_m)) continue;
      const PlantModel& model = draws.variety(layer_.library_->of("boulder"));
      // Few are large: fragments follow a power law.
      const double scale = std::min(0.3 * std::pow(1.0 - draws.unit(kSize), -0.5), 3.0);
      if (!site_.is_free(place.at_world, scale * model.reach_m)) continue;
      add(draws.id, model, place.at_world, draws.heading(), scale,
          static_cast<int>(std::floor(std::log2(4.0 * scale))));
    }
  }
}

/// Of crops that stand so high that it is seen; "": the ground shows the others.
std::string_view species_of(Crop crop) {
  switch (crop) {
    case Crop::Corn:
      return "corn";
    case Crop::Wheat:
      return "wheat";
    case Crop::Vine:
      return "vine";
    default:
      return "";
  }
}

void TileWork::add_crops() {
  const PlantLibrary& library = *layer_.library_;
  const auto cell = [](double at) {
    return static_cast<std::int32_t>(std::floor(at / Fields::kCell_m));
  };
  std::optional<Fields::Found> last;
  for (const Box& box : boxes(kFinestTile, kCropLevel, kCropReach_m)) {
    for (std::int32_t y = cell(box.lowest.y()); y <= cell(box.highest.y()); ++y)
      for (std::int32_t x = cell(box.lowest.x()); x <= cell(box.highest.x()); ++x) {
        const std::optional<CropPiece> crop = layer_.fields_.piece_in(x, y, last);
        if (!crop || !contains(box, crop->center_world) ||
            !is_inside(crop->center_world, layer_.half_size_m_ - kCropPiece_m))
          continue;
        const std::string_view species = species_of(crop->crop);
        if (species.empty()) continue;
        const std::vector<PlantModel>& models = library.of(species);
        if (id_.level - kLevelsAtCorner > models.front().coarsest_level) continue;
        const Vector2d along(std::cos(crop->heading_rad), std::sin(crop->heading_rad));
        const Vector2d across(-along.y(), along.x());
        bool is_field = ground(crop->center_world).slope < kSteepestField;
        for (const double du : {-0.5, 0.5})
          for (const double dv : {-0.5, 0.5})
            is_field =
                is_field && site_.cover(crop->center_world +
                                        kCropPiece_m * (du * along + dv * across)) == Cover::Crops;
        if (!is_field || !site_.is_free(crop->center_world, kCropPiece_m * std::numbers::sqrt2 / 2))
          continue;
        const PlaceDraws draws{layer_.seed_, layer_.numbers_.id(CellNumbers::kCrops, x, y)};
        const PlantModel& model = draws.variety(models);
        const double turn =
            crop->heading_rad / (2.0 * std::numbers::pi) + (draws.unit(kHeading) < 0.5 ? 0.5 : 0.0);
        const auto heading = static_cast<std::uint16_t>(std::lround(turn * 65536.0) & 0xffff);
        add(draws.id, model, crop->center_world, heading, 1.0, model.coarsest_level);
      }
  }
}

std::uint32_t TileWork::clump_id(int size, std::int32_t x, std::int32_t y) const {
  return layer_.numbers_.id(CellNumbers::kClumps + static_cast<std::size_t>(size), x, y);
}

const TileWork::Piece& TileWork::piece(int size, std::int32_t x, std::int32_t y) {
  const auto [entry, is_new] = pieces_[static_cast<std::size_t>(size)].try_emplace(cell_key(x, y));
  if (is_new) entry->second = make_piece(size, x, y);
  return entry->second;
}

TileWork::Piece TileWork::make_piece(int size, std::int32_t x, std::int32_t y) {
  Piece piece;
  const double side_m = clump_side_m(size);
  const Vector2d center = clump_center(size, x, y);
  if (!is_inside(center, layer_.half_size_m_ - 0.5 * side_m)) return piece;
  const Here here = this->here(center);
  if (here.growth.trees < kForestShare) return piece;
  const TreeKinds kinds = tree_kinds(here);
  const double top_m = here.canopy_m.value_or(
      kinds.size * (kBroadleafTop_m + (kConiferTop_m - kBroadleafTop_m) * kinds.conifers));
  piece.is_open = here.growth.trees < kDenseShare;
  piece.kind = kinds.conifers > 0.65                        ? ForestKind::Conifer
               : kinds.pines > 0.55                         ? ForestKind::Pine
               : kinds.conifers + kinds.pines < kMixedShare ? ForestKind::Broadleaf
                                                            : ForestKind::Mixed;
  const std::vector<PlantModel>& models =
      layer_.library_->clumps(piece.kind, size, piece.is_open, top_m);
  // A little wider or narrower than its cell.
  piece.scale = std::clamp(top_m / models.front().height_m, kSmallestClump, kLargestClump);
  const PlaceDraws draws{layer_.seed_, clump_id(size, x, y)};
  piece.model = &draws.variety(models);
  const int level = kFinestClumpLevel + size;
  piece.is_forest = site_.is_free(center, piece.scale * piece.model->reach_m);
  if (piece.is_forest) {
    piece.foot_z_world = site_.ground_z_world(center);
    piece.is_forest = last_level_on_land(center, piece.foot_z_world, level, level) == level;
  }
  piece.is_blocked = !piece.is_forest;
  return piece;
}

void TileWork::add_clumps(int size) {
  const int finest_level = kFinestClumpLevel + size;
  const bool has_parent = size + 1 < kNumClumpSizes;
  const int coarsest_level = has_parent ? finest_level + 1 : finest_level;
  for (const Box& box : boxes(finest_level, coarsest_level, clump_reach_m(size))) {
    // By cells twice as wide: most of them decide for all four in them.
    for (std::int32_t y = clump_cell(box.lowest.y(), size + 1);
         y <= clump_cell(box.highest.y(), size + 1); ++y)
      for (std::int32_t x = clump_cell(box.lowest.x(), size + 1);
           x <= clump_cell(box.highest.x(), size + 1); ++x) {
        // On the next level they are shown themselves; where such a one would be forest and has no
        // room for it, these go on.
        const bool goes_on = has_parent && piece(size + 1, x, y).is_blocked;
        const int last_level = goes_on ? coarsest_level : finest_level;
        if (id_.level > last_level && contains(box_, clump_center(size + 1, x, y))) continue;
        for (const std::int32_t north : {0, 1})
          for (const std::int32_t east : {0, 1})
            add_clump(size, 2 * x + east, 2 * y + north, box, last_level);
      }
  }
}

void TileWork::add_clump(int size, std::int32_t x, std::int32_t y, const Box& box, int last_level) {
  const Vector2d center = clump_center(size, x, y);
  if (!contains(box, center) || !is_inside(center, layer_.half_size_m_)) return;
  const Piece& own = piece(size, x, y);
  if (!own.is_forest) return;
  const PlaceDraws draws{layer_.seed_, clump_id(size, x, y)};
  const auto quarter_turns = static_cast<std::uint16_t>((draws.bits(kHeading) & 3U) << 14U);
  add(draws.id, *own.model, Eigen::Vector3d(center.x(), center.y(), own.foot_z_world),
      quarter_turns, own.scale, last_level, kFinestClumpLevel + size + 1);
}

class VegetationKind final : public LayerKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key(
        "canopy", canopy_,
        "vegetation: a raster of canopy heights above the ground in metres, which decides where "
        "trees stand and how tall they are; left out: land cover, height and slope alone do.");
    visit.key("canopy_nodata", canopy_nodata_,
              "vegetation: value of the canopy's samples without a height: declared (by the file), "
              "none, or a number in quotes.");
  }
  void validate() const override {
    if (canopy_nodata_ != "declared" && canopy_nodata_ != "none" &&
        !number_from_text(canopy_nodata_))
      core::fail(core::ErrorKind::Config,
                 "canopy_nodata = \"{}\" is neither declared, none nor a number", canopy_nodata_);
  }
  std::unique_ptr<LayerKind> clone() const override {
    return std::make_unique<VegetationKind>(*this);
  }
  std::unique_ptr<Layer> make(const LayerInputs& inputs) const override {
    return std::make_unique<VegetationLayer>(inputs, canopy_, canopy_nodata_);
  }

 private:
  core::Path canopy_;
  std::string canopy_nodata_ = "declared";
};

}  // namespace

LayerKindInfo vegetation_layer() {
  return {
      "vegetation",
      "Trees, bushes, grass, reeds, crops and boulders where land cover, climate and ground let "
      "them stand, or where a canopy raster has trees.",
      [] { return std::unique_ptr<LayerKind>(std::make_unique<VegetationKind>()); }};
}

}  // namespace terracast::tiler
