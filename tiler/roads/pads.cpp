#include "tiler/roads/pads.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "core/parallel.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr int kSamplesAlong = 12;
constexpr double kSteepestPad = 0.03;
constexpr double kSteepestApron = 0.01;
/// Where the ground is farther from the plane there is none.
constexpr double kMostOff_m = 6.0;
constexpr double kMostOffAirfield_m = 25.0;
constexpr double kLargest_m = 4000.0;
/// Ways so near to an area lead to it.
constexpr double kNear_m = 4.0;
constexpr double kStationCell_m = 64.0;

std::int64_t key_of(double x, double y) {
  return static_cast<std::int64_t>(std::floor(x / kStationCell_m)) * 0x100000000LL +
         static_cast<std::int64_t>(std::floor(y / kStationCell_m));
}

}  // namespace

Pads make_pads(const std::vector<PaintedArea>& areas, const RoadNetwork& network,
               const RoadHeights& heights, const RoadGroundFunction& ground) {
  std::unordered_map<std::int64_t, std::vector<std::uint32_t>> cells;
  for (const Line& line : network.lines())
    for (const Span& span : line.spans) {
      const WayStyle& style = network.style(span);
      if (style.is_bridge || style.is_tunnel) continue;
      for (std::uint32_t p = span.first_point; p <= span.last_point; ++p) {
        const std::uint32_t station = line.points[p].station;
        const Vector2d& at = network.stations()[station].at_world;
        cells[key_of(at.x(), at.y())].push_back(station);
      }
    }
  std::vector<std::optional<Pad>> made(areas.size());
  std::vector<std::uint8_t> is_steep(areas.size(), 0);
  core::parallel_for(static_cast<std::int64_t>(areas.size()), [&](std::int64_t index) {
    const auto k = static_cast<std::size_t>(index);
    const PaintedArea& area = areas[k];
    const bool is_airfield = area.style.use == PadUse::Airfield;
    if (area.style.use != PadUse::Level && !is_airfield) return;
    Vector2d low = Vector2d::Constant(1e300);
    Vector2d high = Vector2d::Constant(-1e300);
    for (const Vector2d& at : area.rings_world.front()) {
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    if ((high - low).maxCoeff() > kLargest_m) return;
    Pad pad;
    pad.feature = area.feature;
    pad.rings_world = area.rings_world;
    pad.middle_world = 0.5 * (low + high);
    // Least squares of a plane.
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const auto add = [&](const Vector2d& at, double level_m) {
      const Eigen::Vector3d row(at.x() - pad.middle_world.x(), at.y() - pad.middle_world.y(), 1.0);
      products += row * row.transpose();
      right += row * level_m;
    };
    std::vector<std::pair<Vector2d, double>> samples;
    for (int j = 0; j < kSamplesAlong; ++j)
      for (int i = 0; i < kSamplesAlong; ++i) {
        const Vector2d at =
            low + (high - low)
                      .cwiseProduct(Vector2d((i + 0.5) / kSamplesAlong, (j + 0.5) / kSamplesAlong));
        if (side_of_rings(area.rings_world, at).is_inside)
          samples.emplace_back(at, ground(at).level_m);
      }
    for (const Vector2d& at : area.rings_world.front()) {
      if (samples.size() > 400) break;
      samples.emplace_back(at, ground(at).level_m);
    }
    for (const auto& [at, level_m] : samples) add(at, level_m);
    const Eigen::Vector3d plane =
        (products + 1e-6 * Eigen::Matrix3d::Identity()).ldlt().solve(right);
    pad.slope = plane.head<2>();
    const double steepest = is_airfield ? kSteepestApron : kSteepestPad;
    if (pad.slope.norm() > steepest) pad.slope *= steepest / pad.slope.norm();
    double sum = 0.0;
    for (const auto& [at, level_m] : samples) sum += level_m - pad.slope.dot(at - pad.middle_world);
    pad.level_m = sum / static_cast<double>(samples.size());
    // Ways that come in decide.
    double way_sum = 0.0;
    int num_ways = 0;
    for (double y = std::floor((low.y() - kNear_m) / kStationCell_m);
         y <= std::floor((high.y() + kNear_m) / kStationCell_m); y += 1.0)
      for (double x = std::floor((low.x() - kNear_m) / kStationCell_m);
           x <= std::floor((high.x() + kNear_m) / kStationCell_m); x += 1.0) {
        const auto found =
            cells.find(key_of((x + 0.5) * kStationCell_m, (y + 0.5) * kStationCell_m));
        if (found == cells.end()) continue;
        for (const std::uint32_t station : found->second) {
          const Vector2d& at = network.stations()[station].at_world;
          const RingSide side = side_of_rings(area.rings_world, at);
          if (!side.is_inside && side.distance_m > kNear_m) continue;
          way_sum += heights.levels_m()[station] - pad.slope.dot(at - pad.middle_world);
          ++num_ways;
        }
      }
    if (num_ways > 0) pad.level_m = way_sum / num_ways;
    double most_off_m = 0.0;
    for (const auto& [at, level_m] : samples)
      most_off_m = std::max(most_off_m, std::abs(level_m - pad.level_at(at)));
    if (most_off_m > (is_airfield ? kMostOffAirfield_m : kMostOff_m)) {
      is_steep[k] = 1;
      return;
    }
    if (is_airfield) pad.bank_slope = 0.25;
    pad.reach_m = std::min(6.0 + 2.0 * most_off_m / pad.bank_slope, 120.0);
    made[k] = std::move(pad);
  });
  Pads pads;
  for (std::size_t k = 0; k < areas.size(); ++k) {
    if (made[k]) pads.pads.push_back(std::move(*made[k]));
    pads.num_too_steep += is_steep[k];
  }
  return pads;
}

}  // namespace terracast::tiler
