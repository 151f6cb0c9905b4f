#pragma once

#include <array>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "tiler/layer.h"
#include "tiler/objects/footprints.h"
#include "tiler/objects/rules.h"
#include "tiler/told_cover.h"
#include "world/shape.h"

namespace terracast::tiler {

/// More than so many things a world does not have.
inline constexpr std::size_t kMostThings = 2'000'000;

/// What is known of a kind of thing where it is placed.
struct ThingKind {
  Eigen::Vector2d footprint_m = Eigen::Vector2d::Zero();  ///< length and width
  double reach_m = 0.0;                                   ///< of scale 1
  int coarsest_level = 0;
  std::int16_t prototype = -1;
};

/// A thing that stands. Its height is asked for where it is shown.
struct PlacedThing {
  std::uint32_t instance_id = 0;
  std::uint64_t feature = 0;
  Eigen::Vector2d place_world = Eigen::Vector2d::Zero();
  float above_m = 0.0F;
  std::uint16_t heading = 0;
  std::uint16_t scale = 4096;
  std::uint16_t prototype = 0;
  std::uint8_t variety = 0;
};

/// Wires between two supports.
struct WireSpan {
  std::uint32_t instance_id = 0;
  std::uint64_t feature = 0;
  std::size_t from = 0;  ///< placed things
  std::size_t to = 0;
  std::uint32_t from_thing = 0;  ///< rows of all_things()
  std::uint32_t to_thing = 0;
};

/// All things of a layer: which candidates stand was decided once, in an order that depends on them alone.
/// threads   const use is safe
class PlacedThings {
 public:
  /// Takes those candidates that have room: inside the world's square, on what they may stand, where no
  /// earlier layer is, on ground not too steep, and not in one that comes before them (by Rule, then key).
  PlacedThings(const Proposals& proposals, const std::vector<ThingKind>& kinds,
               const LayerInputs& inputs);

  void add_to(const world::TileId& id, const LayerSite& site,
              const std::vector<world::Prototype>& prototypes, const geo::WorldFrame& frame,
              world::TileObjects& objects) const;
  bool holds(const Eigen::Vector2d& place, double radius_m) const {
    return footprints_.holds(place, radius_m);
  }

  /// (thing, variant) of each prototype, in their order.
  const std::vector<std::pair<std::uint32_t, std::uint8_t>>& prototypes() const { return used_; }
  /// For LayerInfo::counts.
  const std::vector<std::pair<std::string, std::int64_t>>& counts() const { return counts_; }
  const std::vector<PlacedThing>& things() const { return things_; }
  std::size_t num_spans() const { return spans_.size(); }
  /// Called once the prototypes are there, for what reaches how far.
  void index(const std::vector<world::Prototype>& prototypes);

 private:
  struct Entry {
    std::uint32_t number;
    bool is_span;
  };
  world::Instance instance_of(const PlacedThing& thing, const LayerSite& site) const;

  std::vector<PlacedThing> things_;
  std::vector<WireSpan> spans_;
  std::vector<std::pair<std::uint32_t, std::uint8_t>> used_;
  std::vector<double> reaches_m_;  ///< of prototypes
  std::vector<int> coarsest_levels_;
  double largest_reach_m_ = 0.0;
  FootprintIndex footprints_;
  std::unordered_map<std::uint64_t, std::vector<Entry>> cells_;
  std::vector<std::pair<std::string, std::int64_t>> counts_;
};

/// The ground under the layers made so far, as a layer's own make() may know it.
class GroundBelow {
 public:
  explicit GroundBelow(const LayerInputs& inputs);
  bool is_water(const Eigen::Vector2d& place) const;
  /// What covers it, where a layer knows.
  std::optional<world::Cover> cover(const Eigen::Vector2d& place) const;
  double z_world(const Eigen::Vector2d& place) const;
  /// Whether an earlier layer holds any of a footprint.
  bool is_held(const GroundRectangle& footprint, bool by_roads_too, bool by_water_too) const;

 private:
  const WorldSurface& surface_;
  ToldCovers covers_;
  double half_size_m_;
  struct Below {
    const Layer* layer;
    bool is_roads;
    bool is_water;
  };
  std::vector<Below> layers_;
};

}  // namespace terracast::tiler
