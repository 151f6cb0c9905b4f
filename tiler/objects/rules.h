#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/schema.h"
#include "tiler/objects/candidate.h"
#include "tiler/objects/vehicle_mix.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {

/// Config keys of what is placed by rules.
struct RuleOptions {
  double parked_cars = 0.6;
  double traffic = 1.0;
  double lamp_spacing_m = 32.0;
  double aircraft = 0.6;
  double containers = 0.7;
  double boats = 0.7;
  bool ships = true;
  bool power_lines = true;
  bool landmarks = true;
  bool barriers = true;
  bool drives_on_left = false;

  void describe(core::SchemaVisitor& visit);
};

/// A wire's way over its supports.
struct PowerLine {
  std::uint64_t feature = 0;
  std::vector<std::size_t> supports;  ///< candidates
};

/// What rules say of features, before it is known what stands in the way.
struct Proposals {
  std::vector<Candidate> candidates;
  std::vector<PowerLine> lines;
};

/// Whether a rule may make something of a feature.
bool is_feature_wanted(const FeatureTags& tags);

struct RuleInputs {
  const std::vector<VectorFeature>& features;  ///< by number
  const RuleOptions& options;
  std::uint64_t seed;
  double half_size_m;
  /// Whether water, by all layers before, lies at a place.
  std::function<bool(const Eigen::Vector2d&)> is_water;
};

Proposals propose(const RuleInputs& inputs);

// The rules, each by its own file.
void propose_traffic(const RuleInputs& inputs, Proposals& to);
void propose_parked_cars(const RuleInputs& inputs, Proposals& to);
void propose_street_lamps(const RuleInputs& inputs, Proposals& to);
void propose_aircraft(const RuleInputs& inputs, Proposals& to);
void propose_ports(const RuleInputs& inputs, Proposals& to);
void propose_boats(const RuleInputs& inputs, Proposals& to);
void propose_yards(const RuleInputs& inputs, Proposals& to);
void propose_ships(const RuleInputs& inputs, Proposals& to);
void propose_power_lines(const RuleInputs& inputs, Proposals& to);
void propose_landmarks(const RuleInputs& inputs, Proposals& to);
void propose_barriers(const RuleInputs& inputs, Proposals& to);

/// Row of all_things().
/// throws   Internal: there is none
std::uint32_t thing_row(std::string_view name);
/// One of several things, and its variant, by a draw.
void choose(Candidate& candidate, std::span<const Chance> chances, std::uint64_t draw);

// Places along lines and in areas.

/// A line's points at given distances along it.
class Walk {
 public:
  explicit Walk(const PointsWorld& line);
  double length_m() const { return along_m_.empty() ? 0.0 : along_m_.back(); }
  Eigen::Vector2d at(double along_m) const;
  Eigen::Vector2d direction(double along_m) const;

 private:
  std::size_t segment(double along_m) const;
  PointsWorld points_;
  std::vector<double> along_m_;
};

/// Rings with an odd number of which round a place.
bool is_inside(const std::vector<PointsWorld>& rings, const Eigen::Vector2d& place);
double area_m2(const std::vector<PointsWorld>& rings);
Eigen::Vector2d middle_of(const VectorFeature& feature);
/// Of the longest edge.
Eigen::Vector2d main_direction(const PointsWorld& ring);

}  // namespace terracast::tiler
