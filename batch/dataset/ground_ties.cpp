#include "batch/dataset/ground_ties.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include "geo/geodesy.h"
#include "geo/units.h"

namespace terracast::batch {

namespace {

/// A line on WGS84 is nowhere shorter than its latitudes and longitudes make it on this sphere: that of
/// the meridian's curvature at the equator.
constexpr double kSphereRadius_m =
    geo::kWgs84SemiMajorAxis_m * (1.0 - geo::kWgs84Flattening) * (1.0 - geo::kWgs84Flattening);

double squared_sine(double angle_rad) { return std::sin(angle_rad) * std::sin(angle_rad); }

/// The least cosine of latitude in a band.
double least_cosine(int band) {
  const CellBounds bounds = bounds_of({band, 0});
  const double farthest_deg = std::max(std::abs(bounds.south_deg), std::abs(bounds.north_deg));
  return std::max(0.0, std::cos(geo::radians_from_degrees(farthest_deg)));
}

/// Cells of two bands whose longitudes are this far apart, or more, are margin_m apart; 0 where all are,
/// 360 where none are said to be.
double reach_deg(int band, int other_band, double margin_m) {
  const double margin_rad = std::min(margin_m / kSphereRadius_m, std::numbers::pi);
  const int bands_between = std::max(0, std::abs(other_band - band) - 1);
  const double gap_rad = geo::radians_from_degrees(bands_between * 180.0 / kGroundBands);
  // Haversines: that of the distance is that of the latitudes' difference and cos cos that of the
  // longitudes'.
  const double left = squared_sine(0.5 * margin_rad) - squared_sine(0.5 * gap_rad);
  if (left <= 0.0) return 0.0;
  const double cosines = least_cosine(band) * least_cosine(other_band);
  if (left >= cosines) return 360.0;
  return geo::degrees_from_radians(2.0 * std::asin(std::sqrt(left / cosines)));
}

/// A run of cells of one ground.
struct OwnedRun {
  std::int32_t band = 0;
  std::int32_t first_column = 0;
  std::int32_t end_column = 0;
  std::int32_t owner = 0;
  auto operator<=>(const OwnedRun&) const = default;
};

double border_deg(std::int32_t band, std::int32_t column) {
  return column * (360.0 / cells_in_band(band)) - 180.0;
}

/// Runs that overlap, as one: all their owners hang together.
struct Strip {
  double west_deg = 0.0;
  double east_deg = 0.0;
  std::size_t begin = 0;  ///< of its runs
  std::size_t end = 0;
  /// The first strip of the band, eastward, that is not known to hang together with this one for being
  /// near.
  std::size_t next_cluster = 0;
};

/// The strips of a band, westmost first.
struct Band {
  std::int32_t band = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Sets of grounds that hang together.
class Forest {
 public:
  explicit Forest(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), 0);
  }

  int root(int ground) {
    while (parent(ground) != ground) ground = parent(ground) = parent(parent(ground));
    return ground;
  }

  void tie(int a, int b, bool is_shared) {
    const int root_a = root(a);
    const int root_b = root(b);
    if (root_a == root_b) return;
    parent(std::max(root_a, root_b)) = std::min(root_a, root_b);
    ties_.push_back({std::min(a, b), std::max(a, b), is_shared});
  }

  GroundTies result() {
    GroundTies result{.components = std::vector<int>(parents_.size()), .ties = ties_};
    for (std::size_t i = 0; i < parents_.size(); ++i) {
      // Roots are the least of their sets: they are numbered before the others.
      const int ground = static_cast<int>(i);
      result.components[i] = root(ground) == ground
                                 ? result.num_components++
                                 : result.components[static_cast<std::size_t>(root(ground))];
    }
    return result;
  }

 private:
  int& parent(int ground) { return parents_[static_cast<std::size_t>(ground)]; }
  std::vector<int> parents_;
  std::vector<GroundTie> ties_;
};

/// Ties the grounds of one world: those that overlap, then those that are near within a band, then
/// between bands. Each band is swept eastward.
class Sweep {
 public:
  Sweep(std::vector<OwnedRun> runs, double margin_m, Forest& forest)
      : runs_(std::move(runs)), margin_m_(margin_m), forest_(forest) {
    std::sort(runs_.begin(), runs_.end());
  }

  void run() {
    tie_shared();
    for (const Band& band : bands_) tie_within(band);
    for (std::size_t i = 0; i < bands_.size(); ++i)
      for (std::size_t k = i + 1; k < bands_.size(); ++k) {
        const double reach = reach_deg(bands_[i].band, bands_[k].band, margin_m_);
        if (reach <= 0.0) break;
        for (const double turn_deg : {-360.0, 0.0, 360.0})
          tie_between(bands_[i], bands_[k], reach, turn_deg);
      }
  }

 private:
  void tie_shared() {
    std::size_t farthest = 0;  // the run of the strip that reaches farthest east
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      const OwnedRun& run = runs_[i];
      const bool is_new_band = bands_.empty() || bands_.back().band != run.band;
      if (is_new_band) bands_.push_back({run.band, strips_.size(), strips_.size()});
      if (is_new_band || run.first_column >= runs_[farthest].end_column) {
        strips_.push_back({.west_deg = border_deg(run.band, run.first_column), .begin = i});
        farthest = i;
      } else {
        forest_.tie(runs_[farthest].owner, run.owner, true);
        if (run.end_column > runs_[farthest].end_column) farthest = i;
      }
      strips_.back().east_deg = border_deg(run.band, runs_[farthest].end_column);
      strips_.back().end = i + 1;
      bands_.back().end = strips_.size();
    }
  }

  void tie_within(const Band& band) {
    const double reach = reach_deg(band.band, band.band, margin_m_);
    strips_[band.end - 1].next_cluster = band.end;
    for (std::size_t i = band.end - 1; i > band.begin; --i) {
      Strip& west = strips_[i - 1];
      const Strip& east = strips_[i];
      const bool is_near = east.west_deg - west.east_deg < reach;
      west.next_cluster = is_near ? east.next_cluster : i;
      if (is_near) tie_near(west, east, 0.0);
    }
    // Across the 180 degree meridian.
    const Strip& first = strips_[band.begin];
    const Strip& last = strips_[band.end - 1];
    if (first.west_deg + 360.0 - last.east_deg < reach) tie_near(last, first, 360.0);
  }

  /// turn_deg   is added to the longitudes of `other`
  void tie_between(const Band& band, const Band& other, double reach, double turn_deg) {
    std::size_t start = other.begin;
    for (std::size_t i = band.begin; i < band.end; ++i) {
      const Strip& strip = strips_[i];
      while (start < other.end && strip.west_deg - (strips_[start].east_deg + turn_deg) >= reach)
        ++start;
      for (std::size_t k = start;
           k < other.end && strips_[k].west_deg + turn_deg - strip.east_deg < reach;
           k = strips_[k].next_cluster)
        tie_near(strip, strips_[k], turn_deg);
    }
  }

  /// Ties two strips by owners that stand where they are nearest.
  void tie_near(const Strip& a, const Strip& b, double turn_deg) {
    if (forest_.root(runs_[a.begin].owner) == forest_.root(runs_[b.begin].owner)) return;
    const double b_west_deg = b.west_deg + turn_deg;
    const double b_east_deg = b.east_deg + turn_deg;
    const double at_a_deg = std::clamp(std::max(a.west_deg, b_west_deg), a.west_deg, a.east_deg);
    const double at_b_deg = std::clamp(at_a_deg, b_west_deg, b_east_deg) - turn_deg;
    forest_.tie(owner_at(a, at_a_deg), owner_at(b, at_b_deg), false);
  }

  int owner_at(const Strip& strip, double lon_deg) const {
    const auto distance_deg = [&](const OwnedRun& run) {
      return std::max({border_deg(run.band, run.first_column) - lon_deg,
                       lon_deg - border_deg(run.band, run.end_column), 0.0});
    };
    return std::min_element(runs_.begin() + static_cast<std::ptrdiff_t>(strip.begin),
                            runs_.begin() + static_cast<std::ptrdiff_t>(strip.end),
                            [&](const OwnedRun& a, const OwnedRun& b) {
                              return distance_deg(a) < distance_deg(b);
                            })
        ->owner;
  }

  std::vector<OwnedRun> runs_;
  double margin_m_;
  Forest& forest_;
  std::vector<Strip> strips_;
  std::vector<Band> bands_;
};

}  // namespace

GroundTies tie_grounds(std::span<const GroundSeen* const> grounds, double margin_m) {
  std::map<std::string, std::vector<OwnedRun>> worlds;
  for (std::size_t i = 0; i < grounds.size(); ++i)
    for (const CellRun& run : grounds[i]->runs)
      worlds[grounds[i]->ground].push_back({run.band, run.first_column,
                                            run.first_column + run.num_cells,
                                            static_cast<std::int32_t>(i)});
  Forest forest(grounds.size());
  for (auto& [ground, runs] : worlds) Sweep(std::move(runs), margin_m, forest).run();
  return forest.result();
}

}  // namespace terracast::batch
