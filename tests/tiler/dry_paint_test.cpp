#include "tiler/dry_paint.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/random.h"
#include "world/tile.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using world::Area;
using world::Cover;
using world::kHeightStep_m;
using world::kTileCells;
using world::Strip;
using world::Tile;
using world::TileId;

using CoverAt = std::function<Cover(const Vector2d&)>;

Tile tile_of(const TileId& id, const CoverAt& cover_at) {
  Tile tile;
  tile.id = id;
  for (int j = 0; j <= kTileCells; ++j)
    for (int i = 0; i <= kTileCells; ++i)
      tile.cover.push_back(cover_at(id.corner_world() + id.spacing_m() * Vector2d(i, j)));
  return tile;
}

Vector2i steps(const Vector2d& at) { return (at / kHeightStep_m).array().round().cast<int>(); }
Vector2d metres(const Vector2i& at) { return kHeightStep_m * at.cast<double>(); }

/// Bays and islets some metres to some hundred metres wide.
Cover coast(const Vector2d& at) {
  const double height = std::sin(at.x() / 31.0) + std::sin(at.y() / 23.0) +
                        0.7 * std::sin((at.x() + at.y()) / 5.0) +
                        0.5 * std::sin(at.x() / 1.7) * std::sin(at.y() / 1.3);
  return height < 0.0 ? Cover::Sea : Cover::Grass;
}

bool is_wet(const CoverAt& cover_at, double spacing_m, int i, int j) {
  return world::is_water(cover_at(spacing_m * Vector2d(i, j)));
}

bool is_amid_water(const CoverAt& cover_at, double spacing_m, const Vector2d& at) {
  const Vector2i cell = (at / spacing_m).array().floor().cast<int>();
  return is_wet(cover_at, spacing_m, cell.x(), cell.y()) &&
         is_wet(cover_at, spacing_m, cell.x() + 1, cell.y()) &&
         is_wet(cover_at, spacing_m, cell.x(), cell.y() + 1) &&
         is_wet(cover_at, spacing_m, cell.x() + 1, cell.y() + 1);
}

/// The plane through the wetness, 0 or 1, of the samples of a place's triangle, there.
double share_of_water(const CoverAt& cover_at, double spacing_m, const Vector2d& at) {
  const Vector2d place = at / spacing_m;
  const Vector2i cell = place.array().floor().cast<int>();
  const int corner = (place - cell.cast<double>()).sum() > 1.0 ? 1 : 0;
  const std::array<Vector2i, 3> samples = {cell + Vector2i(corner, corner), cell + Vector2i(1, 0),
                                           cell + Vector2i(0, 1)};
  Eigen::Matrix3d rows;
  Eigen::Vector3d wetness;
  for (int k = 0; k < 3; ++k) {
    const Vector2i& sample = samples[static_cast<std::size_t>(k)];
    rows.row(k) << sample.x() - cell.x(), sample.y() - cell.y(), 1.0;
    wetness[k] = is_wet(cover_at, spacing_m, sample.x(), sample.y()) ? 1.0 : 0.0;
  }
  const Eigen::Vector3d plane = rows.fullPivLu().solve(wetness);
  const Vector2d in_cell = place - cell.cast<double>();
  return plane.dot(Eigen::Vector3d(in_cell.x(), in_cell.y(), 1.0));
}

bool holds(const Area& area, const Vector2d& at) {
  bool is_in = false;
  for (const auto& ring : area.rings_steps)
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vector2d a = metres(ring[k]), b = metres(ring[(k + 1) % ring.size()]);
      if ((a.y() > at.y()) != (b.y() > at.y()) &&
          at.x() < a.x() + (at.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
        is_in = !is_in;
    }
  return is_in;
}

double distance_to_rings(const Area& area, const Vector2d& at) {
  double nearest_m = 1e300;
  for (const auto& ring : area.rings_steps)
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vector2d a = metres(ring[k]), way = metres(ring[(k + 1) % ring.size()]) - a;
      const double t = std::clamp((at - a).dot(way) / std::max(way.squaredNorm(), 1e-12), 0.0, 1.0);
      nearest_m = std::min(nearest_m, (a + t * way - at).norm());
    }
  return nearest_m;
}

Area area_of(const std::vector<std::vector<Vector2d>>& rings, std::uint64_t feature = 1) {
  Area area;
  area.coating = {.feature = feature,
                  .paving = world::Paving::Cobbles,
                  .semantic_class = core::SemanticClass::Path};
  for (const auto& ring : rings) {
    area.rings_steps.emplace_back();
    for (const Vector2d& at : ring) area.rings_steps.back().push_back(steps(at));
  }
  return area;
}

TEST(DryPaint, AreasAreWhatIsDryOfThem) {
  for (const TileId id : {TileId{0, 0, 0}, TileId{-2, -3, 1}, TileId{3, -1, 0}}) {
    SCOPED_TRACE(id.name());
    const double spacing_m = id.spacing_m();
    const Vector2d corner = id.corner_world();
    const double side_m = id.side_m();
    // One that crosses itself and has a hole, and reaches beyond the tile; one inside.
    std::vector<Vector2d> star, hole, inside;
    for (int k = 0; k < 7; ++k) {
      const double turn = 2.0 * std::numbers::pi * 3.0 * k / 7.0;
      star.push_back(
          corner + side_m * (Vector2d(0.7, 0.6) + 0.55 * Vector2d(std::cos(turn), std::sin(turn))));
    }
    for (const Vector2d& at : {Vector2d(0.62, 0.5), Vector2d(0.81, 0.52), Vector2d(0.7, 0.7)})
      hole.push_back(corner + side_m * at);
    for (const Vector2d& at : {Vector2d(0.05, 0.07), Vector2d(0.4, 0.11), Vector2d(0.2, 0.43)})
      inside.push_back(corner + side_m * at);
    const std::vector<Area> drawn = {area_of({star, hole}, 1), area_of({inside}, 2)};
    Tile tile = tile_of(id, coast);
    tile.objects.areas = drawn;
    tiler::end_paint_at_water(tile, [](const Vector2d&) {
      ADD_FAILURE() << "areas need no samples beyond the tile";
      return Cover::Land;
    });
    ASSERT_EQ(tile.objects.areas.size(), 2U);
    int num_dry = 0, num_wet = 0;
    for (std::uint64_t k = 0; k < 20000; ++k) {
      const Vector2d at =
          corner + side_m * Vector2d(core::random_unit(5, k, 0), core::random_unit(5, k, 1));
      const double share = share_of_water(coast, spacing_m, at);
      for (std::size_t a = 0; a < 2; ++a) {
        // Corners where edges cross are rounded to steps, and edges with them.
        if (distance_to_rings(drawn[a], at) < 2.0 * kHeightStep_m ||
            std::abs(share - 0.5) * spacing_m < 4.0 * kHeightStep_m)
          continue;
        const bool is_painted = holds(tile.objects.areas[a], at);
        if (!holds(drawn[a], at)) {
          EXPECT_FALSE(is_painted) << at.transpose();
          continue;
        }
        EXPECT_EQ(is_painted, share < 0.5) << at.transpose() << " of " << share;
        ++(is_painted ? num_dry : num_wet);
      }
    }
    EXPECT_GT(num_dry, 1000);
    EXPECT_GT(num_wet, 1000);
  }
}

TEST(DryPaint, WhatReachesOverNoWaterAndWhatMayStandInItIsLeft) {
  const CoverAt bay = [](const Vector2d& at) {
    return (at - Vector2d(100.0, 100.0)).norm() < 40.0 ? Cover::Lake : Cover::Land;
  };
  const auto square = [](double low_m, double high_m) {
    return std::vector<Vector2d>{
        {low_m, low_m}, {high_m, low_m}, {high_m, high_m}, {low_m, high_m}};
  };
  Tile tile = tile_of({0, 0, 0}, bay);
  Area pier = area_of({square(90.0, 150.0)}, 1);
  pier.coating.semantic_class = core::SemanticClass::Pier;
  Area stream = area_of({square(90.0, 150.0)}, 2);
  stream.coating.paving = world::Paving::Water;
  // Round the bay: its box has all of it, its hole too.
  const Area round = area_of({square(20.0, 300.0), square(50.0, 150.0)}, 3);
  Strip brook;
  brook.coating.paving = world::Paving::Water;
  brook.points_steps = {steps({0.0, 100.0}), steps({200.0, 100.0})};
  Strip beside;
  beside.points_steps = {steps({0.0, 20.0}), steps({500.0, 20.0})};
  tile.objects.areas = {pier, stream, round};
  tile.objects.strips = {brook, beside};
  const world::TileObjects before = tile.objects;
  tiler::end_paint_at_water(tile, bay);
  EXPECT_EQ(tile.objects, before);
  // All of it in the water.
  tile.objects.areas = {area_of({square(95.0, 105.0)})};
  beside.points_steps = {steps({90.0, 90.0}), steps({110.0, 110.0})};
  tile.objects.strips = {beside};
  tiler::end_paint_at_water(tile, bay);
  EXPECT_TRUE(tile.objects.areas.empty());
  EXPECT_TRUE(tile.objects.strips.empty());
}

TEST(DryPaint, StripsAreCutAmidWaterAndTheirMarksGoOn) {
  // Seen in Bilbao in November 2026: the end of a street on a spit that is narrower than samples are apart.
  for (const TileId id : {TileId{0, 0, 0}, TileId{-1, 1, 0}, TileId{3, 0, -1}}) {
    SCOPED_TRACE(id.name());
    const double spacing_m = id.spacing_m();
    const Vector2d corner = id.corner_world();
    Tile tile = tile_of(id, coast);
    Tile beside = tile_of(id.neighbour(1, 0), coast);
    std::vector<Strip> drawn;
    for (std::uint64_t k = 0; k < 40; ++k) {
      Strip strip;
      strip.coating.feature = k;
      strip.start_m = 7.0;
      strip.whole_m = 1000.0;
      Vector2d at = corner + id.side_m() * Vector2d(0.9, core::random_unit(1, k, 0));
      for (std::uint64_t p = 0; p < 12; ++p) {
        // Some points lie on samples, some on borders of cells.
        if (p % 3 == 1) at = spacing_m * (at / spacing_m).array().round();
        if (p % 3 == 2) at.x() = spacing_m * std::round(at.x() / spacing_m);
        strip.points_steps.push_back(steps(at));
        at += spacing_m *
              Vector2d(4.0 + core::random_unit(2, k, p), 9.0 * core::random_unit(3, k, p));
      }
      drawn.push_back(strip);
    }
    tile.objects.strips = drawn;
    beside.objects.strips = drawn;
    tiler::end_paint_at_water(tile, coast);
    tiler::end_paint_at_water(beside, coast);
    EXPECT_EQ(tile.objects.strips, beside.objects.strips);
    EXPECT_GT(tile.objects.strips.size(), drawn.size());
    for (const Strip& strip : tile.objects.strips) {
      ASSERT_GE(strip.points_steps.size(), 2U);
      for (const Vector2i& point : strip.points_steps)
        EXPECT_FALSE(is_amid_water(coast, spacing_m, metres(point))) << metres(point).transpose();
    }
    int num_dry = 0, num_wet = 0;
    for (const Strip& strip : drawn) {
      double along_m = strip.start_m;
      for (std::size_t p = 0; p + 1 < strip.points_steps.size(); ++p) {
        const Vector2d a = metres(strip.points_steps[p]), b = metres(strip.points_steps[p + 1]);
        for (double t = 0.005; t < 1.0; t += 0.01) {
          const Vector2d at = a + t * (b - a);
          // Ends are drawn back from borders of cells, until they are out of the water after rounding.
          const Vector2d in_cell = at / spacing_m - (at / spacing_m).array().floor().matrix();
          const double to_border = std::min(in_cell.minCoeff(), 1.0 - in_cell.maxCoeff());
          if (to_border < 0.1) continue;
          // On which piece, and where along it.
          bool is_there = false;
          for (const Strip& piece : tile.objects.strips) {
            if (piece.coating.feature != strip.coating.feature) continue;
            double piece_along_m = piece.start_m;
            for (std::size_t q = 0; q + 1 < piece.points_steps.size(); ++q) {
              const Vector2d from = metres(piece.points_steps[q]);
              const Vector2d way = metres(piece.points_steps[q + 1]) - from;
              const double share = (at - from).dot(way) / way.squaredNorm();
              if (share >= 0.0 && share <= 1.0 &&
                  (from + share * way - at).norm() < 2.0 * kHeightStep_m) {
                is_there = true;
                EXPECT_NEAR(piece_along_m + share * way.norm(), along_m + t * (b - a).norm(), 0.01);
              }
              piece_along_m += way.norm();
            }
          }
          const bool is_wet = is_amid_water(coast, spacing_m, at);
          EXPECT_EQ(is_there, !is_wet) << at.transpose();
          ++(is_wet ? num_wet : num_dry);
        }
        along_m += (b - a).norm();
      }
    }
    EXPECT_GT(num_dry, 1000);
    EXPECT_GT(num_wet, 1000);
  }
}

}  // namespace
}  // namespace terracast::test
