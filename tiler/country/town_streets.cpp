#include "tiler/country/town_streets.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tiler/country/zones.h"

namespace terracast::tiler::country {
namespace {

constexpr std::uint64_t kStream = 0x737472656574;
constexpr double kStep_m = 12.0;
constexpr double kSteepest = 0.17;
constexpr double kEndReach_m = 75.0;   ///< to the next street that a street's end goes on to
constexpr double kWiderStreets = 1.9;  ///< how much farther apart streets of industry are

/// A direction without sign, as the direction of twice its angle: such can be averaged.
Point doubled(const Point& d) { return {d.x() * d.x() - d.y() * d.y(), 2.0 * d.x() * d.y()}; }
Point halved(const Point& doubled_direction) {
  const Point d = doubled_direction.normalized();
  const double x = std::sqrt(std::max(0.5 * (1.0 + d.x()), 0.0));
  const double y = std::sqrt(std::max(0.5 * (1.0 - d.x()), 0.0));
  return {x, d.y() < 0.0 ? -y : y};
}

}  // namespace

TownShape::TownShape(const Settlement& settlement, const PlanGround& ground, std::uint64_t seed)
    : settlement_(settlement), ground_(ground), rim_(seed, kStream) {}

double TownShape::at(const Point& place) const {
  const Point from = place - settlement_.center;
  const double noise = fractal_noise(rim_, place.x() / 700.0, place.y() / 700.0, 3);
  const double far = from.norm() / settlement_.radius_m;
  return far * (1.0 + 0.55 * noise * std::min(far, 1.0)) +
         1.2 * std::max(ground_.slope(place) - 0.06, 0.0);
}

StreetGrowth::StreetGrowth(const PlanGround& ground, const std::vector<Way>& roads,
                           const Occupancy& obstacles)
    : ground_(ground),
      obstacles_(obstacles),
      sample_index_(ground.half_size_m()),
      piece_index_(ground.half_size_m()) {
  for (const Way& road : roads) add_samples(road.line, 2);
}

void StreetGrowth::add_samples(const PointsWorld& line, int family) {
  const PointsWorld points = resampled(line, kStep_m);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Point along =
        (k + 1 < points.size() ? points[k + 1] - points[k] : points[k] - points[k - 1]);
    sample_index_.add(static_cast<std::int32_t>(samples_.size()), points[k], points[k]);
    samples_.push_back({points[k], along.normalized(), family, num_lines_});
  }
  for (std::size_t k = 1; k < line.size(); ++k) add_piece(line[k - 1], line[k], num_lines_);
  ++num_lines_;
}

void StreetGrowth::add_piece(const Point& from, const Point& to, std::int32_t line) {
  piece_index_.add(static_cast<std::int32_t>(pieces_.size()), from.cwiseMin(to), from.cwiseMax(to));
  pieces_.push_back({from, to, line});
}

Point StreetGrowth::direction(const TownShape& shape, const Point& at, int family) const {
  const Settlement& town = shape.settlement();
  const Point from = at - town.center;
  const double far = shape.at(at);
  const double t = 0.45 * (*bend_)(at.x() / 1500.0, at.y() / 1500.0);
  Point sum = doubled(turned(main_, t));
  if (const double distance_m = from.norm(); distance_m > 15.0)
    sum += 2.2 * std::max(1.0 - 2.6 * far, 0.0) * doubled(from / distance_m);
  const Point gradient = ground_.gradient(at);
  if (const double slope = gradient.norm(); slope > 0.02)
    sum += std::min(30.0 * (slope - 0.02), 2.5) * doubled(left_of(gradient / slope));
  // Beside a road streets run along it or off it.
  constexpr double kReach_m = 160.0;
  sample_index_.find(at.array() - kReach_m, at.array() + kReach_m, found_);
  double nearest_m = kReach_m;
  Point along = Point::Zero();
  for (const std::int32_t index : found_) {
    const Sample& sample = samples_[static_cast<std::size_t>(index)];
    if (sample.family != 2) continue;
    if (const double distance_m = (sample.at - at).norm(); distance_m < nearest_m) {
      nearest_m = distance_m;
      along = sample.along;
    }
  }
  if (nearest_m < kReach_m) {
    // Where it lies across the field's first direction it stands for the second.
    Point road = doubled(along);
    if (road.dot(sum) < 0.0) road = -road;
    sum += 2.5 * (1.0 - nearest_m / kReach_m) * road;
  }
  if (sum.norm() < 1e-3) sum = doubled(main_);
  const Point d = halved(sum);
  return family == 0 ? d : left_of(d);
}

double StreetGrowth::separation_m(const TownShape& shape, const Point& at, int family) const {
  const double far = shape.at(at);
  const double close = shape.settlement().rank == Rank::City ? 78.0 : 64.0;
  double base = close + 45.0 * std::clamp(far, 0.0, 1.0);
  // Halls and their yards are deeper than gardens.
  if (zone_of(shape.settlement(), at, far, seed_) == Zone::Industry) base *= kWiderStreets;
  return family == 0 ? base : 1.55 * base;
}

bool StreetGrowth::is_open(const TownShape& shape, const Point& at) const {
  return shape.at(at) < 1.0 && ground_.slope(at) < kSteepest && ground_.is_in_square(at, 60.0) &&
         ground_.sea_distance_m(at) > 45.0;
}

double StreetGrowth::nearest_m(const Point& at, const Point& along, double reach_m,
                               std::int32_t own) const {
  sample_index_.find(at.array() - reach_m, at.array() + reach_m, found_);
  double nearest = reach_m;
  for (const std::int32_t index : found_) {
    const Sample& sample = samples_[static_cast<std::size_t>(index)];
    if (sample.line == own || std::abs(sample.along.dot(along)) < 0.75) continue;
    nearest = std::min(nearest, (sample.at - at).norm());
  }
  return nearest;
}

void StreetGrowth::trace(const TownShape& shape, Point at, int family, double sign,
                         PointsWorld& line) const {
  Point along = sign * direction(shape, at, family);
  for (int k = 0; k < 260; ++k) {
    Point next_along = direction(shape, at + 0.5 * kStep_m * along, family);
    if (next_along.dot(along) < 0.0) next_along = -next_along;
    if (next_along.dot(along) < 0.8) return;
    const Point next = at + kStep_m * next_along;
    if (!is_open(shape, next)) return;
    if (!obstacles_.is_free(at, next, 9.0, kInTheWay)) return;
    const double apart_m = 0.5 * separation_m(shape, next, family);
    if (nearest_m(next, next_along, apart_m, -1) < apart_m) return;
    // Not back to itself.
    for (std::size_t p = 0; p + 12 < line.size(); ++p)
      if ((line[p] - next).norm() < apart_m) return;
    line.push_back(next);
    at = next;
    along = next_along;
  }
}

void StreetGrowth::settle_end(PointsWorld& line, double reach_m, std::int32_t own) {
  const Point end = line.back();
  const Point along = (end - line[line.size() - 2]).normalized();
  const Point far = end + reach_m * along;
  const auto first_crossing = [&](const Point& from, const Point& to, bool is_last) {
    piece_index_.find(from.cwiseMin(to), from.cwiseMax(to), found_);
    double best = is_last ? -1.0 : 2.0;
    for (const std::int32_t index : found_) {
      const Piece& piece = pieces_[static_cast<std::size_t>(index)];
      if (piece.line == own) continue;
      if (const auto share = crossing(from, to, piece.from, piece.to))
        best = is_last ? std::max(best, *share) : std::min(best, *share);
    }
    return best;
  };
  if (const double share = first_crossing(end, far, false); share <= 1.0) {
    const Point at = end + share * reach_m * along;
    if (ground_.sea_distance_m(at) > 30.0 && obstacles_.is_free(end, at, 8.0, kInTheWay)) {
      line.push_back(at);
      add_piece(end, at, own);
      return;
    }
  }
  // A stub of less than a house's frontage beyond the last crossing is cut off.
  double beyond_m = 0.0;
  for (std::size_t k = line.size() - 1; k > 0; --k) {
    const double share = first_crossing(line[k - 1], line[k], true);
    const double length = (line[k] - line[k - 1]).norm();
    if (share >= 0.0) {
      if (beyond_m + (1.0 - share) * length > 40.0) return;
      const Point at = line[k - 1] + share * (line[k] - line[k - 1]);
      line.resize(k);
      line.push_back(at);
      return;
    }
    beyond_m += length;
    if (beyond_m > 40.0) return;
  }
}

std::vector<Way> StreetGrowth::grow(const TownShape& shape, std::uint64_t seed) {
  const Settlement& town = shape.settlement();
  const GradientNoise bend(seed, kStream + 1);
  bend_ = &bend;
  seed_ = seed;
  // The main direction is that of the nearest road.
  double nearest_m = 1e9;
  for (const Sample& sample : samples_)
    if (sample.family == 2 && (sample.at - town.center).norm() < nearest_m) {
      nearest_m = (sample.at - town.center).norm();
      main_ = sample.along;
    }
  if (main_.x() < 0.0) main_ = -main_;
  const double cell_m = 34.0;
  const int reach = static_cast<int>(std::ceil(1.35 * town.radius_m / cell_m));
  struct Seed {
    double distance_m;
    Point at;
    int family;
  };
  std::vector<Seed> seeds;
  for (int j = -reach; j <= reach; ++j)
    for (int i = -reach; i <= reach; ++i) {
      const auto key = static_cast<std::uint64_t>((j + reach) * (2 * reach + 1) + i + reach);
      const Point at =
          town.center + cell_m * Point(i + core::random_unit(seed, kStream + 2, key) - 0.5,
                                       j + core::random_unit(seed, kStream + 3, key) - 0.5);
      seeds.push_back({std::round((at - town.center).norm()), at, static_cast<int>(key % 2)});
    }
  std::stable_sort(seeds.begin(), seeds.end(),
                   [](const Seed& a, const Seed& b) { return a.distance_m < b.distance_m; });
  std::vector<PointsWorld> lines;
  const std::int32_t first_line = num_lines_;
  for (const Seed& from : seeds) {
    if (!is_open(shape, from.at) || !obstacles_.is_free(from.at, 20.0, kInTheWay)) continue;
    const Point along = direction(shape, from.at, from.family);
    const double apart_m = separation_m(shape, from.at, from.family);
    if (this->nearest_m(from.at, along, apart_m, -1) < apart_m) continue;
    PointsWorld ahead{from.at}, behind{from.at};
    trace(shape, from.at, from.family, 1.0, ahead);
    trace(shape, from.at, from.family, -1.0, behind);
    PointsWorld line(behind.rbegin(), behind.rend() - 1);
    line.insert(line.end(), ahead.begin(), ahead.end());
    if (length_of(line) < 60.0) continue;
    add_samples(line, from.family);
    lines.push_back(std::move(line));
  }
  std::vector<Way> ways;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    PointsWorld& line = lines[k];
    for (int end = 0; end < 2; ++end) {
      const Point& at = line.back();
      const bool is_industry = zone_of(town, at, shape.at(at), seed) == Zone::Industry;
      settle_end(line, is_industry ? kWiderStreets * kEndReach_m : kEndReach_m,
                 first_line + static_cast<std::int32_t>(k));
      std::reverse(line.begin(), line.end());
    }
    if (length_of(line) < 25.0) continue;
    Way way;
    way.line = simplified(line, 0.35);
    way.kind = RoadKind::Residential;
    way.is_urban = true;
    ways.push_back(std::move(way));
  }
  bend_ = nullptr;
  return ways;
}

}  // namespace terracast::tiler::country
