#include "tiler/roads/area_pier.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace terracast::tiler {
namespace {

using Steps = Eigen::Matrix<std::int64_t, 2, 1>;

/// More corners are not looked at: each is compared with each other.
constexpr std::size_t kMostCorners = 1500;
constexpr int kCoarsestLevel = 7;

/// Twice the area of a triangle, above 0 anticlockwise; exact.
std::int64_t twice_area(const Steps& a, const Steps& b, const Steps& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

int side_of(const Steps& a, const Steps& b, const Steps& p) {
  const std::int64_t twice = twice_area(a, b, p);
  return twice > 0 ? 1 : twice < 0 ? -1 : 0;
}

bool is_between(const Steps& a, const Steps& b, const Steps& p) {
  return (p.array() >= a.cwiseMin(b).array()).all() && (p.array() <= a.cwiseMax(b).array()).all();
}

/// Whether two edges have a place in common.
bool do_meet(const Steps& a, const Steps& b, const Steps& c, const Steps& d) {
  const int c_side = side_of(a, b, c);
  const int d_side = side_of(a, b, d);
  const int a_side = side_of(c, d, a);
  const int b_side = side_of(c, d, b);
  if (c_side * d_side < 0 && a_side * b_side < 0) return true;
  return (c_side == 0 && is_between(a, b, c)) || (d_side == 0 && is_between(a, b, d)) ||
         (a_side == 0 && is_between(c, d, a)) || (b_side == 0 && is_between(c, d, b));
}

bool is_simple(const std::vector<Steps>& ring) {
  const std::size_t count = ring.size();
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = i + 2; j < count; ++j) {
      if (i == 0 && j + 1 == count) continue;  // neighbours
      if (do_meet(ring[i], ring[i + 1], ring[j], ring[(j + 1) % count])) return false;
    }
  return true;
}

/// Cuts a simple ring, anticlockwise, without corners in line, into triangles by its ears (Meisters 1975).
std::vector<std::array<std::uint32_t, 3>> cut_ears(const std::vector<Steps>& ring) {
  std::vector<std::uint32_t> left(ring.size());
  for (std::uint32_t i = 0; i < left.size(); ++i) left[i] = i;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  while (left.size() > 3) {
    bool has_ear = false;
    for (std::size_t i = 0; i < left.size() && !has_ear; ++i) {
      const std::uint32_t before = left[(i + left.size() - 1) % left.size()];
      const std::uint32_t at = left[i];
      const std::uint32_t after = left[(i + 1) % left.size()];
      if (twice_area(ring[before], ring[at], ring[after]) <= 0) continue;
      const bool is_clear = std::none_of(left.begin(), left.end(), [&](std::uint32_t other) {
        return other != before && other != at && other != after &&
               side_of(ring[before], ring[at], ring[other]) >= 0 &&
               side_of(ring[at], ring[after], ring[other]) >= 0 &&
               side_of(ring[after], ring[before], ring[other]) >= 0;
      });
      if (!is_clear) continue;
      triangles.push_back({before, at, after});
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
      has_ear = true;
    }
    if (!has_ear) return {};
  }
  if (twice_area(ring[left[0]], ring[left[1]], ring[left[2]]) <= 0) return {};
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace

std::optional<world::Solid> build_area_pier(const PointsWorld& ring_world, double low_z,
                                            double high_z, bool is_stone) {
  std::vector<Steps> ring;
  for (const Eigen::Vector2d& at : ring_world) {
    const Steps steps = (at / world::kHeightStep_m).array().round().cast<std::int64_t>().matrix();
    if (ring.empty() || ring.back() != steps) ring.push_back(steps);
  }
  while (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  // Corners in line are none.
  for (std::size_t i = 0; ring.size() >= 3 && i < ring.size();) {
    const Steps& before = ring[(i + ring.size() - 1) % ring.size()];
    if (twice_area(before, ring[i], ring[(i + 1) % ring.size()]) == 0)
      ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
    else
      ++i;
  }
  if (ring.size() < 3 || ring.size() > kMostCorners || !is_simple(ring)) return std::nullopt;
  std::int64_t twice = 0;
  for (std::size_t i = 1; i + 1 < ring.size(); ++i)
    twice += twice_area(ring[0], ring[i], ring[i + 1]);
  if (twice < 0) std::reverse(ring.begin(), ring.end());
  const auto triangles = cut_ears(ring);
  if (triangles.empty()) return std::nullopt;

  world::Solid solid;
  const Steps origin = ring.front();
  const auto low = static_cast<std::int64_t>(std::llround(low_z / world::kHeightStep_m));
  const auto high = static_cast<std::int64_t>(std::llround(high_z / world::kHeightStep_m));
  solid.origin_steps = {static_cast<int>(origin.x()), static_cast<int>(origin.y()),
                        static_cast<int>(low)};
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Steps& at : ring) middle += at.cast<double>() * world::kHeightStep_m;
  solid.place_m = (middle / static_cast<double>(ring.size())).array().floor().cast<int>();
  world::Shape shape;
  const auto what = core::SemanticClass::Pier;
  shape.finishes = {{.material = is_stone ? world::Material::Boulder : world::Material::Concrete,
                     .semantic_class = what,
                     .color_srgb = {static_cast<std::uint8_t>(is_stone ? 146 : 170), 166, 156}},
                    {.material = is_stone ? world::Material::Boulder : world::Material::StoneWall,
                     .semantic_class = what,
                     .color_srgb = {142, 136, 124}}};
  for (const std::int64_t z : {std::int64_t{0}, high - low})
    for (const Steps& at : ring)
      shape.vertices_steps.emplace_back(static_cast<int>(at.x() - origin.x()),
                                        static_cast<int>(at.y() - origin.y()), static_cast<int>(z));
  const auto count = static_cast<std::uint32_t>(ring.size());
  for (const auto& t : triangles) {
    shape.triangles.push_back({.corners = {t[0] + count, t[1] + count, t[2] + count}, .finish = 0});
    shape.triangles.push_back({.corners = {t[0], t[2], t[1]}, .finish = 1});
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    shape.triangles.push_back({.corners = {i, next, next + count}, .finish = 1});
    shape.triangles.push_back({.corners = {i, next + count, i + count}, .finish = 1});
  }
  solid.levels.push_back({.coarsest_level = kCoarsestLevel, .shape = std::move(shape)});
  return solid;
}

}  // namespace terracast::tiler
