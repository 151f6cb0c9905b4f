#include "world/paint_index.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "geo/box3.h"

namespace terracast::world {
namespace {

/// Along a side of a tile; of rows too.
constexpr int kMostCells = 64;
/// Entries that cells (rows) may hold in all, whatever is painted, and for each coat (edge) beside.
constexpr std::size_t kEntries = 1 << 15;
constexpr std::size_t kEntriesPerCoat = 8;
/// More than places of a tile err by.
constexpr double kAround_m = 0x1.0p-10;

using Box2 = Eigen::AlignedBox2d;

Eigen::Vector2d metres(const Eigen::Vector2i& steps) {
  return steps.cast<double>() * kHeightStep_m;
}

Box2 box_of(const Area& area) {
  Box2 box;
  for (const auto& ring : area.rings_steps)
    for (const Eigen::Vector2i& point : ring) box.extend(metres(point));
  return box;
}

/// Distance of a place from a line between two points, squared.
double squared_distance(const Eigen::Vector2d& place, const Eigen::Vector2d& a,
                        const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double share = std::clamp((place - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (a + share * along - place).squaredNorm();
}

}  // namespace

PaintIndex::PaintIndex(const TileId& id, std::vector<Strip> strips, std::vector<Area> areas)
    : id_(id), strips_(std::move(strips)), areas_(std::move(areas)) {
  for (std::uint32_t i = 0; i < strips_.size(); ++i) {
    double start_m = strips_[i].start_m;
    const auto& points = strips_[i].points_steps;
    for (std::uint32_t point = 0; point + 1 < points.size(); ++point) {
      ranked_.push_back({i, point, start_m});
      start_m += (metres(points[point + 1]) - metres(points[point])).norm();
    }
  }
  for (std::uint32_t i = 0; i < areas_.size(); ++i) ranked_.push_back({i, kArea, 0.0});
  // Strips before areas, then as they stand in the tile.
  std::stable_sort(ranked_.begin(), ranked_.end(), [&](const Coat& a, const Coat& b) {
    const Coating& first = coating(a);
    const Coating& second = coating(b);
    return std::tuple(first.order, first.feature) > std::tuple(second.order, second.feature);
  });

  std::size_t num_edges = 0;
  for (const Area& area : areas_)
    for (const auto& ring : area.rings_steps) num_edges += ring.size();
  for (int num_rows = kMostCells; num_rows >= 1; num_rows /= 2) {
    fill_rows(num_rows);
    if (edges_.size() <= kEntries + kEntriesPerCoat * num_edges) break;
  }
  edges_.shrink_to_fit();
  for (int num_cells = kMostCells; num_cells >= 1; num_cells /= 2) {
    fill_cells(num_cells);
    if (coats_.size() <= kEntries + kEntriesPerCoat * ranked_.size()) break;
  }
  coats_.shrink_to_fit();
  for (Area& area : areas_) area.rings_steps = {};  // their edges are in the rows
}

void PaintIndex::fill_rows(int num_rows) {
  num_rows_ = num_rows;
  row_begins_.clear();
  edges_.clear();
  const double south = id_.corner_world().y();
  const double row_m = id_.side_m() / num_rows;
  const auto row_of = [&](double y) {
    return static_cast<int>(std::clamp(std::floor((y - south) / row_m), -1.0, double(num_rows)));
  };
  std::vector<std::vector<Edge>> rows(static_cast<std::size_t>(num_rows));
  for (const Area& area : areas_) {
    for (auto& row : rows) row.clear();
    for (const auto& ring : area.rings_steps) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        Edge edge{ring[i], ring[(i + 1) % ring.size()]};
        if (edge.south.y() == edge.north.y()) continue;
        if (edge.south.y() > edge.north.y()) std::swap(edge.south, edge.north);
        const int last = row_of(edge.north.y() * kHeightStep_m + kAround_m);
        for (int row = std::max(row_of(edge.south.y() * kHeightStep_m - kAround_m), 0);
             row <= std::min(last, num_rows - 1); ++row)
          rows[static_cast<std::size_t>(row)].push_back(edge);
      }
    }
    for (const auto& row : rows) {
      row_begins_.push_back(static_cast<std::uint32_t>(edges_.size()));
      edges_.insert(edges_.end(), row.begin(), row.end());
    }
  }
  row_begins_.push_back(static_cast<std::uint32_t>(edges_.size()));
}

void PaintIndex::fill_cells(int num_cells) {
  num_cells_ = num_cells;
  const Eigen::Vector2d corner = id_.corner_world();
  const double cell_m = id_.side_m() / num_cells;
  const double half_diagonal_m = cell_m * M_SQRT1_2 + kAround_m;
  const std::size_t count =
      static_cast<std::size_t>(num_cells) * static_cast<std::size_t>(num_cells);
  // Twice over: how many, then which.
  const auto visit = [&](const auto& put) {
    for (std::uint32_t rank = 0; rank < ranked_.size(); ++rank) {
      const Coat& coat = ranked_[rank];
      Box2 box;
      Eigen::Vector2d a = Eigen::Vector2d::Zero();
      Eigen::Vector2d b = a;
      double reach_m = 0.0;
      if (coat.point == kArea) {
        box = box_of(areas_[coat.index]);
      } else {
        const Strip& strip = strips_[coat.index];
        a = metres(strip.points_steps[coat.point]);
        b = metres(strip.points_steps[coat.point + 1]);
        reach_m = strip.half_width_steps * kHeightStep_m;
        box.extend(a).extend(b);
        box.min().array() -= reach_m;
        box.max().array() += reach_m;
      }
      if (box.isEmpty()) continue;
      const auto cell_of = [&](double x, int axis) {
        return static_cast<int>(
            std::clamp(std::floor((x - corner[axis]) / cell_m), -1.0, double(num_cells)));
      };
      for (int y = std::max(cell_of(box.min().y() - kAround_m, 1), 0);
           y <= std::min(cell_of(box.max().y() + kAround_m, 1), num_cells - 1); ++y) {
        for (int x = std::max(cell_of(box.min().x() - kAround_m, 0), 0);
             x <= std::min(cell_of(box.max().x() + kAround_m, 0), num_cells - 1); ++x) {
          const Eigen::Vector2d middle = corner + cell_m * Eigen::Vector2d(x + 0.5, y + 0.5);
          const double far_m = reach_m + half_diagonal_m;
          if (coat.point != kArea && squared_distance(middle, a, b) > far_m * far_m) continue;
          put(static_cast<std::size_t>(y * num_cells + x), rank);
        }
      }
    }
  };
  cell_begins_.assign(count + 1, 0);
  visit([&](std::size_t cell, std::uint32_t) { ++cell_begins_[cell + 1]; });
  for (std::size_t cell = 0; cell < count; ++cell) cell_begins_[cell + 1] += cell_begins_[cell];
  coats_.resize(cell_begins_.back());
  std::vector<std::uint32_t> next(cell_begins_.begin(), cell_begins_.end() - 1);
  visit([&](std::size_t cell, std::uint32_t rank) { coats_[next[cell]++] = rank; });
}

std::size_t PaintIndex::num_bytes() const {
  std::size_t bytes = sizeof *this + ranked_.capacity() * sizeof(Coat) +
                      (row_begins_.capacity() + cell_begins_.capacity() + coats_.capacity()) *
                          sizeof(std::uint32_t) +
                      edges_.capacity() * sizeof(Edge);
  for (const Strip& strip : strips_)
    bytes += sizeof strip + strip.points_steps.capacity() * sizeof(Eigen::Vector2i);
  for (const Area& area : areas_) bytes += sizeof area;
  return bytes;
}

const Coating& PaintIndex::coating(const Coat& coat) const {
  return coat.point == kArea ? areas_[coat.index].coating : strips_[coat.index].coating;
}

PaintIndex::Nearest PaintIndex::nearest(const Coat& coat, double x_world, double y_world) const {
  const auto& points = strips_[coat.index].points_steps;
  const Eigen::Vector2d a = metres(points[coat.point]);
  const Eigen::Vector2d along = metres(points[coat.point + 1]) - a;
  const Eigen::Vector2d offset = Eigen::Vector2d(x_world, y_world) - a;
  const double share = std::clamp(offset.dot(along) / along.squaredNorm(), 0.0, 1.0);
  const Eigen::Vector2d away = offset - share * along;
  const double squared_m2 = away.squaredNorm();
  const bool is_left = along.x() * offset.y() - along.y() * offset.x() >= 0.0;
  return {.squared_m2 = squared_m2,
          .along_m = coat.start_m + share * along.norm(),
          .across_m = is_left ? std::sqrt(squared_m2) : -std::sqrt(squared_m2)};
}

int PaintIndex::row_at(double y_world) const {
  const double row = (y_world - id_.corner_world().y()) / (id_.side_m() / num_rows_);
  return static_cast<int>(std::clamp(row, 0.0, num_rows_ - 1.0));
}

bool PaintIndex::is_in(const Area& area, double x_world, double y_world) const {
  const std::size_t row =
      static_cast<std::size_t>(&area - areas_.data()) * static_cast<std::size_t>(num_rows_) +
      static_cast<std::size_t>(row_at(y_world));
  bool is_odd = false;
  for (std::uint32_t i = row_begins_[row]; i < row_begins_[row + 1]; ++i) {
    const Eigen::Vector2d south = metres(edges_[i].south);
    const Eigen::Vector2d north = metres(edges_[i].north);
    if (!(south.y() <= y_world && y_world < north.y())) continue;
    const double east = (north.x() - south.x()) * (y_world - south.y()) -
                        (x_world - south.x()) * (north.y() - south.y());
    if (east > 0.0) is_odd = !is_odd;
  }
  return is_odd;
}

void PaintIndex::find(double x_world, double y_world, PaintSample& sample) const {
  sample.is_painted = false;
  const Eigen::Vector2d corner = id_.corner_world();
  const double cells_per_m = num_cells_ / id_.side_m();
  const auto cell_of = [&](double x, double low) {
    return static_cast<std::size_t>(std::clamp((x - low) * cells_per_m, 0.0, num_cells_ - 1.0));
  };
  const std::size_t cell = cell_of(y_world, corner.y()) * static_cast<std::size_t>(num_cells_) +
                           cell_of(x_world, corner.x());
  const Coat* seen = nullptr;
  Nearest best{};
  for (std::uint32_t i = cell_begins_[cell]; i < cell_begins_[cell + 1]; ++i) {
    const Coat& coat = ranked_[coats_[i]];
    if (seen != nullptr && (coating(coat).order != coating(*seen).order ||
                            coating(coat).feature != coating(*seen).feature))
      break;
    if (coat.point == kArea) {
      if (seen != nullptr || !is_in(areas_[coat.index], x_world, y_world)) continue;
      seen = &coat;
      continue;
    }
    const Nearest near = nearest(coat, x_world, y_world);
    const double half_width_m = strips_[coat.index].half_width_steps * kHeightStep_m;
    if (near.squared_m2 > half_width_m * half_width_m) continue;
    if (seen != nullptr && near.squared_m2 >= best.squared_m2) continue;
    seen = &coat;
    best = near;
  }
  if (seen == nullptr) return;
  sample = {.is_painted = true, .coating = coating(*seen)};
  if (seen->point == kArea) return;
  const Strip& strip = strips_[seen->index];
  sample.marking = strip.marking;
  sample.num_lanes = strip.num_lanes;
  sample.across_m = best.across_m;
  sample.along_m = best.along_m;
  sample.half_width_m = strip.half_width_steps * kHeightStep_m;
  sample.whole_m = strip.whole_m;
  sample.unmarked_start_m = strip.unmarked_start_m;
  sample.unmarked_end_m = strip.unmarked_end_m;
}

}  // namespace terracast::world
