#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tiler/buildings/building_mesh.h"
#include "tiler/buildings/building_tags.h"
#include "tiler/buildings/height_raster.h"
#include "tiler/buildings/raster_outlines.h"
#include "tiler/buildings/setback.h"
#include "tiler/buildings/settled_ground.h"
#include "tiler/buildings/town.h"
#include "tiler/dry_cover.h"
#include "tiler/feature_source.h"
#include "tiler/instance_ids.h"
#include "tiler/layer.h"
#include "tiler/no_data.h"
#include "tiler/surface.h"
#include "tiler/surveyed_ground.h"
#include "tiler/told_cover.h"
#include "tiler/vector_source.h"
#include "tiler/world_options.h"

// Buildings. What stands where and how high is settled once (Town); the solids are built tile by
// tile, each a pure function of its building and of the ground under it. A tile of which it is
// known that it shows a building coarsely is not given its fine shapes.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;
using world::kHeightStep_m;

/// Bumped when what stands where changes.
constexpr int kBuildingsVersion = 13;

/// Coarsest tiles of the shapes with all their details, and of those with roofs.
constexpr int kFineLevel = 1;
constexpr int kPlainLevel = 3;
constexpr int kCoarsestLevel = 8;
/// As LayerStack shows objects: beyond the tile of its place by that tile's level, which is finer
/// by two at a corner, and by one more for each doubling of its reach beyond the finest tile.
constexpr int kLevelsAtCorner = 2;
constexpr double kFinestSide_m = 32.0;
/// Eaves reach so far from the footprint, and walls that lean, as up does far from the origin.
constexpr double kReach_m = 1.5;
/// Foundations go so deep below the lowest ground, and by so much of a terrain sample's spacing
/// more: between coarse samples the ground may lie lower than it is. Where coarse tiles show it
/// lower still, as beside a cutting of which they hold few samples, they go down to that.
constexpr double kFoundation_m = 1.6;
constexpr double kPerSpacing = 0.5;
/// Finer tiles show all ground but walls.
constexpr int kCoarseGround = 3;
/// In the sea walls go down to its floor, or so far.
constexpr double kQuay_m = 12.0;
/// Corners of a footprint at which the ground is looked at.
constexpr std::size_t kMostGroundPlaces = 48;

int coarsest_level_of(const Building& building) {
  const Vector2d size = building.highest_world - building.lowest_world;
  const double seen_m = std::max(std::sqrt(size.x() * size.y()), 0.7 * building.design.top_m);
  return std::clamp(static_cast<int>(std::floor(std::log2(std::max(seen_m, 1.0)))) + 1, 2,
                    kCoarsestLevel);
}

class BuildingsLayer final : public Layer, public DryCover {
 public:
  /// is_planned   whether the features are a country's, which says what lies open in its towns
  BuildingsLayer(const LayerInputs& inputs, FeatureSet features,
                 std::unique_ptr<HeightRaster> raster, bool is_planned,
                 const MeasuredHeights& measured_m = {})
      : frame_(inputs.frame), name_(features.name), hash_(features.content_hash) {
    const ToldCovers earlier_covers(inputs.earlier);
    const auto is_water = [&](const Vector2d& place) {
      return earlier_covers.is_water_on(inputs.surface, place);
    };
    std::vector<const Town*> earlier_towns;
    std::vector<RankedBuildings> earlier_ranks;
    std::vector<const Layer*> others;
    for (const auto& earlier : inputs.earlier) {
      const auto* buildings = dynamic_cast<const BuildingsLayer*>(earlier.get());
      if (buildings == nullptr) {
        others.push_back(earlier.get());
        continue;
      }
      earlier_towns.push_back(&buildings->town_);
      earlier_ranks.push_back({buildings->town_.buildings, buildings->ranks_});
    }
    const auto is_taken = [&](const Vector2d& place) {
      return std::any_of(others.begin(), others.end(),
                         [&](const Layer* other) { return other->holds(place, 0.0); });
    };
    const auto height_m = [&](const Vector2d& place) {
      return frame_
          .geodetic_from_world(
              {place.x(), place.y(), inputs.surface.sample(place.x(), place.y()).z_world})
          .height_m;
    };
    const std::uint64_t seed = core::stream_of(inputs.seed, 0x6275696c64ULL);
    const std::function<bool(const Vector2d&)> is_sea = [&](const Vector2d& place) {
      return inputs.surface.sample(place.x(), place.y()).cover == world::Cover::Sea;
    };
    town_ = build_town(features.features, raster.get(),
                       {.is_water = is_water,
                        .is_sea = is_sea,
                        .is_taken = is_taken,
                        .height_m = height_m,
                        .latitude_deg = frame_.origin().lat_deg,
                        .earlier = std::move(earlier_towns)},
                       inputs.size_m, seed, measured_m);
    settled_ = SettledGround(town_.buildings, inputs.size_m, is_planned ? nullptr : is_sea, seed);
    Setbacks setbacks = setback_ranks(town_.buildings, earlier_ranks);
    ranks_ = std::move(setbacks.ranks);
    measure_boxes();
    std::vector<std::uint64_t> keys;
    for (const Building& building : town_.buildings) keys.push_back(building.key);
    ids_ = inputs.ids.assign("buildings", keys);
    counts_ = std::move(features.counts);
    ledger_ = std::move(features.ledger);
    if (raster) ledger_.merge(raster->ledger());
    counts_.insert(counts_.end(), town_.counts.begin(), town_.counts.end());
    counts_.insert(counts_.end(), setbacks.counts.begin(), setbacks.counts.end());
    if (const std::int64_t num = num_roofs_that_do_not_fit(); num > 0) {
      counts_.emplace_back("roofs of a stated shape that does not fit, built with another", num);
      inputs.context.log.warn(
          "{}: {} roofs have a shape (roof:shape) that does not fit their footprint or their "
          "height; another is built",
          name_, num);
    }
    hash_ +=
        fmt::format(" {} {} {}", kBuildingsVersion, seed, raster ? raster->content_hash() : "");
  }

  world::LayerInfo info() const override {
    world::LayerInfo info;
    info.source = name_;
    info.content_hash = core::content_hash(hash_);
    info.counts = counts_;
    info.ledger = ledger_;
    return info;
  }
  std::string input_hash() const override { return core::content_hash("buildings " + hash_); }

  std::optional<world::Cover> cover(const Vector2d& place_world,
                                    const SurfaceSample&) const override {
    return settled_.cover(place_world);
  }

  bool holds(const Vector2d& place_world, double radius_m) const override {
    bool is_held = false;
    town_.index.visit(
        place_world.array() - radius_m, place_world.array() + radius_m, BoxIndex::kAll,
        [&](std::uint32_t row) {
          const Building& building = town_.buildings[row];
          if ((place_world.array() + radius_m < building.lowest_world.array()).any() ||
              (place_world.array() - radius_m > building.highest_world.array()).any())
            return true;
          const Vector2d at =
              (place_world - building.footprint.place_m.cast<double>()) / kHeightStep_m;
          is_held = contains(building.footprint.rings, at) ||
                    distance_to_edges(building.footprint.rings, at) <= radius_m / kHeightStep_m;
          return !is_held;
        });
    return is_held;
  }

  void add_objects(const world::TileId& id, const LayerSite& site,
                   world::TileObjects& objects) const override {
    const Vector2d corner = id.corner_world();
    const Vector2d opposite = corner.array() + id.side_m();
    for (const std::uint32_t row :
         town_.index.rows_in(corner.array() - farthest_m_, opposite.array() + farthest_m_)) {
      const Building& building = town_.buildings[row];
      const Box& box = boxes_[row];
      if ((box.highest_world.array() < corner.array()).any() ||
          (box.lowest_world.array() > opposite.array()).any())
        continue;
      // The finest level by which a tile that holds its place may show it here.
      int finest = id.level;
      const Vector2i& place = building.footprint.place_m;
      if (world::tile_at(id.level, place.x(), place.y()) != id) {
        const double reach_m = (box.highest_world - box.lowest_world).maxCoeff();
        finest -= kLevelsAtCorner + 1 +
                  static_cast<int>(std::ceil(std::log2(std::max(reach_m / kFinestSide_m, 1.0))));
      }
      if (finest > coarsest_level_of(building)) continue;
      objects.solids.push_back(solid_of(row, finest, site));
    }
  }

 private:
  /// Of all that is shown of a building.
  struct Box {
    Vector2d lowest_world;
    Vector2d highest_world;
  };

  RingsSteps walls_of(std::size_t row) const {
    return tiler::walls_of(town_.buildings[row], ranks_[row]);
  }

  /// Of roofs that are drawn, none is missed.
  std::int64_t num_roofs_that_do_not_fit() const {
    std::atomic<std::int64_t> num = 0;
    core::parallel_for(static_cast<std::int64_t>(town_.buildings.size()), [&](std::int64_t k) {
      const auto row = static_cast<std::size_t>(k);
      const Building& building = town_.buildings[row];
      if (!building.design.states_roof) return;
      BuildingPlan plan;
      plan.rings = walls_of(row);
      plan.design = &building.design;
      plan.attached = building.attached;
      plan.own = building.own;
      plan.foundation_steps = kFoundation_m / kHeightStep_m;
      if (!bears_its_roof(plan)) ++num;
    });
    return num;
  }

  void measure_boxes() {
    boxes_.resize(town_.buildings.size());
    core::parallel_for_blocks(
        static_cast<std::int64_t>(boxes_.size()), 256, [&](std::int64_t begin, std::int64_t end) {
          for (auto row = static_cast<std::size_t>(begin); row < static_cast<std::size_t>(end);
               ++row) {
            const Building& building = town_.buildings[row];
            Box& box = boxes_[row];
            box = {building.lowest_world, building.highest_world};
            const RingsSteps block = block_of(walls_of(row));
            for (const Vector2i& corner : block.front()) {
              const Vector2d at =
                  building.footprint.place_m.cast<double>() + kHeightStep_m * corner.cast<double>();
              box.lowest_world = box.lowest_world.cwiseMin(at);
              box.highest_world = box.highest_world.cwiseMax(at);
            }
            box.lowest_world.array() -= kReach_m;
            box.highest_world.array() += kReach_m;
          }
        });
    farthest_m_ = 0.0;
    for (std::size_t row = 0; row < boxes_.size(); ++row) {
      const Building& building = town_.buildings[row];
      farthest_m_ =
          std::max({farthest_m_, (building.lowest_world - boxes_[row].lowest_world).maxCoeff(),
                    (boxes_[row].highest_world - building.highest_world).maxCoeff()});
    }
  }

  struct Ground {
    double lowest_z = 0.0;   ///< world z at the place, of a level through the lowest ground
    double highest_m = 0.0;  ///< above the lowest
    bool is_in_sea = false;
    std::vector<Vector2d> places_world;  ///< that were looked at
  };

  Ground ground_of(const Building& building, const Eigen::Matrix3d& world_from_level,
                   const LayerSite& site) const {
    const Vector2d place = building.footprint.place_m.cast<double>();
    const std::vector<Vector2i>& corners = ground_corners(building);
    const std::size_t stride = corners.size() / kMostGroundPlaces + 1;
    double lowest = std::numeric_limits<double>::infinity();
    double highest = -lowest;
    Ground ground;
    const auto look = [&](const Vector2d& at_m) {
      // Along up, from the level of world z 0 at the place.
      const double z = site.ground_z_world(place + at_m);
      const double height = world_from_level.col(2).dot(Vector3d(at_m.x(), at_m.y(), z));
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
      ground.is_in_sea = ground.is_in_sea || site.cover(place + at_m) == world::Cover::Sea;
      ground.places_world.push_back(place + at_m);
    };
    for (std::size_t i = 0; i < corners.size(); i += stride) {
      const Vector2d a = kHeightStep_m * corners[i].cast<double>();
      const Vector2d b = kHeightStep_m * corners[(i + 1) % corners.size()].cast<double>();
      look(a);
      const double length_m = (b - a).norm();
      const int num_between = std::min(static_cast<int>(length_m / 12.0), 8);
      for (int k = 1; k <= num_between; ++k) look(a + (b - a) * k / (num_between + 1));
    }
    // Heights along up to z at the place.
    ground.lowest_z = lowest / world_from_level(2, 2);
    ground.highest_m = highest - lowest;
    return ground;
  }

  /// How far below its lowest ground tiles show the ground of a building: of each level the most of
  /// it and all finer ones.
  /// block   on which its coarsest shape stands
  std::vector<double> shown_below_m(const Building& building, const Ground& ground,
                                    const RingsSteps& block,
                                    const Eigen::Matrix3d& world_from_level, int last_level,
                                    const LayerSite& site) const {
    const Vector2d place = building.footprint.place_m.cast<double>();
    const double beside_m = 0.5 * (building.highest_world - building.lowest_world).norm() +
                            std::numbers::sqrt2 * std::exp2(kCoarseGround - 1);
    const bool has_walls = site.has_walls_near(place, beside_m);
    std::vector<Vector2d> places_world = ground.places_world;
    for (const Vector2i& corner : block.front())
      places_world.push_back(place + kHeightStep_m * corner.cast<double>());
    std::map<std::pair<double, double>, double> known;  // samples, of all levels
    const auto sample_z = [&](const Vector2d& sample) {
      const auto [entry, is_new] = known.try_emplace({sample.x(), sample.y()}, 0.0);
      if (is_new) entry->second = site.ground_z_world(sample);
      return entry->second;
    };
    std::vector<double> below_m(static_cast<std::size_t>(last_level + 1), 0.0);
    for (int level = has_walls ? 0 : kCoarseGround; level <= last_level; ++level) {
      double& most_m = below_m[static_cast<std::size_t>(level)];
      if (level > 0) most_m = below_m[static_cast<std::size_t>(level - 1)];
      for (const Vector2d& at : places_world) {
        const double z = shown_z_world(sample_z, at, level);
        const double height =
            world_from_level.col(2).dot(Vector3d(at.x() - place.x(), at.y() - place.y(), z));
        most_m = std::max(most_m, ground.lowest_z * world_from_level(2, 2) - height);
      }
    }
    return below_m;
  }

  world::Solid solid_of(std::uint32_t row, int finest_level, const LayerSite& site) const {
    const Building& building = town_.buildings[row];
    const Vector2i& place = building.footprint.place_m;
    world::Solid solid;
    solid.provenance.instance_id = ids_[row];
    solid.provenance.feature = building.feature;
    solid.place_m = place;
    const Vector3d at(place.x(), place.y(), site.ground_z_world(place.cast<double>()));
    const Vector3d up = frame_.up_world(at);
    BuildingPlan plan;
    plan.world_from_level.col(2) = up;
    plan.world_from_level.col(0) = (Vector3d::UnitX() - up.x() * up).normalized();
    plan.world_from_level.col(1) = up.cross(Vector3d(plan.world_from_level.col(0)));
    const Ground ground = ground_of(building, plan.world_from_level, site);
    constexpr int kSteps = static_cast<int>(1.0 / kHeightStep_m);
    solid.origin_steps = {place.x() * kSteps, place.y() * kSteps,
                          static_cast<int>(std::lround(ground.lowest_z / kHeightStep_m))};
    plan.rings = walls_of(row);
    plan.setback_steps = kSetback_m * ranks_[row] / kHeightStep_m;
    plan.design = &building.design;
    plan.attached = building.attached;
    plan.own = building.own;
    plan.highest_ground_steps = ground.highest_m / kHeightStep_m;
    const double ground_m = frame_.geodetic_from_world({at.x(), at.y(), ground.lowest_z}).height_m;
    plan.lowest_ground_steps = ground_m / kHeightStep_m;
    plan.levels_steps = kLevels_m / kHeightStep_m;
    const int last_level = coarsest_level_of(building);
    // What reaches over a tile's corner stands on ground two levels coarser there.
    const std::vector<double> below_m =
        shown_below_m(building, ground, block_of(plan.rings), plan.world_from_level,
                      last_level + kLevelsAtCorner, site);
    const auto add = [&](int coarsest_level, BuildingDetail detail) {
      if (finest_level > coarsest_level) return;
      const double depth_m =
          kFoundation_m + (ground.is_in_sea ? kQuay_m : 0.0) +
          std::max(kPerSpacing * std::exp2(static_cast<double>(coarsest_level)),
                   below_m[static_cast<std::size_t>(coarsest_level + kLevelsAtCorner)]);
      const double bottom_m = kLevels_m * std::floor((ground_m - depth_m) / kLevels_m);
      plan.foundation_steps = (ground_m - bottom_m + kSetback_m * ranks_[row]) / kHeightStep_m;
      solid.levels.push_back({.coarsest_level = static_cast<std::int8_t>(coarsest_level),
                              .shape = building_shape(plan, detail)});
    };
    add(std::min(kFineLevel, last_level), BuildingDetail::Fine);
    if (last_level > kFineLevel) add(std::min(kPlainLevel, last_level), BuildingDetail::Plain);
    if (last_level > kPlainLevel) add(last_level, BuildingDetail::Block);
    return solid;
  }

  const geo::WorldFrame& frame_;
  std::string name_;
  std::string hash_;
  Town town_;
  std::vector<int> ranks_;   ///< of the town's buildings, by which they stand back
  std::vector<Box> boxes_;   ///< of the town's buildings
  double farthest_m_ = 0.0;  ///< that a box reaches beyond its footprint's
  SettledGround settled_;
  std::vector<std::uint32_t> ids_;
  std::vector<std::pair<std::string, std::int64_t>> counts_;
  core::Ledger ledger_;
};

/// Takes out piers and the like that are tagged as buildings, too: the layer `roads` builds them.
void leave_to_roads(const LayerInputs& inputs, FeatureSet& features) {
  const auto num_left =
      static_cast<std::int64_t>(std::erase_if(features.features, [](const VectorFeature& feature) {
        return is_one_of(BuildingTags(feature.tags).value("man_made"), "pier|breakwater|quay");
      }));
  if (num_left == 0) return;
  features.counts.emplace_back("piers, breakwaters and quays left to a layer of roads", num_left);
  const std::vector<LayerOptions>& layers = inputs.surface.options().layers;
  if (std::none_of(layers.begin(), layers.end(),
                   [](const LayerOptions& layer) { return layer.kind == "roads"; }))
    inputs.context.log.warn(
        "{}: {} areas tagged building are piers, breakwaters or quays; a layer of kind \"roads\" "
        "builds them, and this world has none: they are left out",
        features.name, num_left);
}

void leave_out_hidden(FeatureSet& features) {
  HiddenCounts hidden;
  std::erase_if(features.features, [&](const VectorFeature& feature) {
    return hidden.is_hidden(feature.tags, SightOf::Building);
  });
  hidden.append_to(features.counts);
}

constexpr const char* kFromRaster = "raster";

/// Of buildings from a raster: they are known wherever it has a height.
class RasterSurvey final : public GroundSurvey {
 public:
  explicit RasterSurvey(RasterOutlines outlines) : outlines_(std::move(outlines)) {}
  const SurveyedGround& ground() const override { return outlines_.ground; }
  std::unique_ptr<Layer> make(const LayerInputs& inputs) override {
    return std::make_unique<BuildingsLayer>(inputs, std::move(outlines_.features), nullptr, false,
                                            outlines_.medians_m);
  }

 private:
  RasterOutlines outlines_;
};

class BuildingsKind final : public LayerKind, public SurveyingKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    const OwnSource raster{kFromRaster,
                           "buildings without footprints: outlines of what heights, or surface "
                           "less terrain, shows to stand above the ground."};
    source_.describe(visit, {&raster, 1});
    visit.key("every_area", every_area_,
              "buildings: take every area of the files for a building, also those without a "
              "building or building:part tag: for files that hold footprints alone.");
    visit.key("heights", heights_,
              "buildings: a raster of heights above the ground in metres, for buildings that say "
              "neither height nor building:levels.");
    visit.key("surface", surface_,
              "buildings: in place of heights, a raster of the heights of what is seen from above; "
              "terrain is subtracted.");
    visit.key("terrain", terrain_,
              "buildings: a raster of the bare ground's heights, on the datum of surface.");
    visit.key("heights_nodata", nodata_,
              "buildings: values of samples without a height: declared (by the file), none, or "
              "numbers in quotes.");
    outlines_.describe(visit);
  }
  void validate() const override {
    source_.validate();
    if (source_.source == kFromRaster && heights_.empty() && surface_.empty())
      core::fail(core::ErrorKind::Config,
                 "source = \"raster\" needs heights = \"…\", or surface = \"…\" and terrain = "
                 "\"…\", of which it makes buildings");
    if (surface_.empty() != terrain_.empty())
      core::fail(core::ErrorKind::Config,
                 "surface and terrain go together: a building's height is their difference");
    if (!heights_.empty() && !surface_.empty())
      core::fail(core::ErrorKind::Config,
                 "heights and surface both say how high buildings are; state one of them");
    if (!NoData::from_text(nodata_))
      core::fail(core::ErrorKind::Config, "heights_nodata = \"{}\" is none of {}", nodata_,
                 kNoDataWords);
  }
  std::unique_ptr<LayerKind> clone() const override {
    return std::make_unique<BuildingsKind>(*this);
  }
  std::unique_ptr<Layer> make(const LayerInputs& inputs) const override {
    if (const auto raster = survey(inputs)) return raster->make(inputs);
    VectorOptions wanted;
    wanted.points = false;
    wanted.lines = false;
    wanted.wanted = [every_area = every_area_](const FeatureTags& tags) {
      return every_area || is_tagged_building(tags);
    };
    FeatureSet features = read_features(source_, std::move(wanted), inputs, building_tag_table());
    if (features.features.empty() && !every_area_)
      inputs.context.log.warn(
          "{}: no area is tagged building or building:part; every_area = true takes all areas",
          features.name);
    if (!every_area_) leave_to_roads(inputs, features);
    leave_out_hidden(features);
    std::unique_ptr<HeightRaster> raster;
    if (!heights_.empty() || !surface_.empty())
      raster = HeightRaster::open(heights_.empty() ? surface_ : heights_, terrain_, nodata_,
                                  inputs.surface, inputs.size_m);
    return std::make_unique<BuildingsLayer>(inputs, std::move(features), std::move(raster),
                                            source_.source == "country");
  }
  std::unique_ptr<GroundSurvey> survey(const LayerInputs& inputs) const override {
    if (source_.source != kFromRaster) return nullptr;
    return std::make_unique<RasterSurvey>(read_raster_outlines(height_files(), outlines_, inputs));
  }

 private:
  HeightFiles height_files() const {
    return {heights_.empty() ? surface_ : heights_, terrain_, nodata_};
  }

  FeatureSourceOptions source_;
  bool every_area_ = false;
  core::Path heights_;
  core::Path surface_;
  core::Path terrain_;
  std::string nodata_ = "declared";
  RasterOutlineOptions outlines_;
};

}  // namespace

LayerKindInfo buildings_layer() {
  return {"buildings",
          "Buildings on their footprints, or on what a raster shows to stand: walls with storeys "
          "and roofs, with heights from tags, rasters or a guess by kind, size and neighbourhood.",
          [] { return std::unique_ptr<LayerKind>(std::make_unique<BuildingsKind>()); }};
}

}  // namespace terracast::tiler
