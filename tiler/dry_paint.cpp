#include "tiler/dry_paint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "tiler/even_odd.h"
#include "tiler/roofs/triangulation.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using world::kHeightStep_m;
using world::kTileCells;
using world::Strip;

/// Of a level's samples, told by their numbers from the origin, which are water.
class Samples {
 public:
  Samples(const world::Tile& tile, const std::function<world::Cover(const Vector2d&)>& cover_at)
      : tile_(tile),
        cover_at_(cover_at),
        spacing_steps_(tile.id.spacing_m() / kHeightStep_m),
        first_(kTileCells * Vector2i(tile.id.x, tile.id.y)) {
    has_water_ = std::any_of(tile.cover.begin(), tile.cover.end(),
                             [](world::Cover cover) { return world::is_water(cover); });
  }

  double spacing_steps() const { return spacing_steps_; }
  /// Of the tile's south-western corner.
  const Vector2i& first() const { return first_; }
  bool has_water_in_square() const { return has_water_; }

  bool is_water(const Vector2i& sample) const {
    const Vector2i own = sample - first_;
    if (is_in_square(own))
      return world::is_water(tile_.cover[world::Tile::sample(own.x(), own.y())]);
    const auto [known, is_new] = beyond_.try_emplace(key_of(sample), false);
    if (is_new)
      known->second = world::is_water(cover_at_(tile_.id.spacing_m() * sample.cast<double>()));
    return known->second;
  }
  /// Whether all four samples round a place are.
  bool is_amid_water(const Vector2d& at_steps) const {
    const Vector2i cell = (at_steps / spacing_steps_).array().floor().cast<int>();
    for (const int north : {0, 1})
      for (const int east : {0, 1})
        if (!is_water(cell + Vector2i(east, north))) return false;
    return true;
  }

 private:
  static bool is_in_square(const Vector2i& own) {
    return (own.array() >= 0).all() && (own.array() <= kTileCells).all();
  }
  static std::uint64_t key_of(const Vector2i& sample) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(sample.x())) << 32U |
           static_cast<std::uint32_t>(sample.y());
  }

  const world::Tile& tile_;
  const std::function<world::Cover(const Vector2d&)>& cover_at_;
  double spacing_steps_;
  Vector2i first_;
  bool has_water_ = false;
  mutable std::unordered_map<std::uint64_t, bool> beyond_;
};

Vector2i rounded(const Vector2d& at) { return at.array().round().cast<int>(); }

/// Cuts a strip where its line comes amid water.
class StripCutter {
 public:
  StripCutter(const Samples& samples, const Strip& strip) : samples_(samples), strip_(strip) {}

  /// Nothing where it stays as it is.
  std::optional<std::vector<Strip>> cut() {
    const auto& points = strip_.points_steps;
    double along_steps = 0.0;
    begin(points.front().cast<double>(), along_steps, false);
    for (std::size_t k = 0; k + 1 < points.size(); ++k) {
      const Vector2d a = points[k].cast<double>();
      const Vector2d step = points[k + 1].cast<double>() - a;
      for_each_cell(a, step, [&](double from, double to) {
        if (samples_.is_amid_water(a + 0.5 * (from + to) * step)) {
          end(true);
          return;
        }
        if (!is_open_) begin(a + from * step, along_steps + from * step.norm(), true);
        head_ = a + to * step;
      });
      along_steps += step.norm();
      if (!is_open_) continue;
      if (!samples_.is_amid_water(head_)) {
        run_.push_back(head_);
        continue;
      }
      // On the border of a cell of water, which it does not enter.
      end(true);
      if (k + 2 < points.size()) begin(points[k + 1].cast<double>(), along_steps, true);
    }
    end(false);
    if (!is_cut_) return std::nullopt;
    return std::move(pieces_);
  }

 private:
  /// The parts of an edge from cell to cell, as shares of it.
  template <class Visit>
  void for_each_cell(const Vector2d& a, const Vector2d& step, const Visit& visit) {
    stops_ = {0.0, 1.0};
    for (const int axis : {0, 1}) {
      if (step[axis] == 0.0) continue;
      const double low = std::min(a[axis], a[axis] + step[axis]) / samples_.spacing_steps();
      const double high = std::max(a[axis], a[axis] + step[axis]) / samples_.spacing_steps();
      for (double line = std::floor(low) + 1.0; line < high; line += 1.0)
        stops_.push_back((line * samples_.spacing_steps() - a[axis]) / step[axis]);
    }
    std::sort(stops_.begin(), stops_.end());
    for (std::size_t i = 0; i + 1 < stops_.size(); ++i)
      if (stops_[i + 1] > stops_[i]) visit(stops_[i], std::min(stops_[i + 1], 1.0));
  }

  void begin(const Vector2d& at, double along_steps, bool is_cut) {
    is_open_ = true;
    run_ = {at};
    head_ = at;
    run_along_steps_ = along_steps;
    begins_cut_ = is_cut || samples_.is_amid_water(rounded(at).cast<double>());
    is_cut_ = is_cut_ || begins_cut_;
  }
  void end(bool is_cut) {
    if (!is_open_) return;
    is_open_ = false;
    is_cut_ = is_cut_ || is_cut;
    if (is_cut) {
      run_.push_back(head_);
      draw_back(run_);
    }
    if (begins_cut_) {
      std::reverse(run_.begin(), run_.end());
      const double was_steps = length_of(run_);
      draw_back(run_);
      run_along_steps_ += was_steps - length_of(run_);
      std::reverse(run_.begin(), run_.end());
    }
    Strip piece = strip_;
    piece.start_m = strip_.start_m + run_along_steps_ * kHeightStep_m;
    piece.points_steps.clear();
    for (const Vector2d& at : run_) {
      const Vector2i point = rounded(at);
      if (piece.points_steps.empty() || piece.points_steps.back() != point)
        piece.points_steps.push_back(point);
    }
    if (piece.points_steps.size() > 1) pieces_.push_back(std::move(piece));
  }
  /// Takes away from a line's end until that is out of the water, after rounding too.
  void draw_back(std::vector<Vector2d>& line) const {
    double back_steps = 0.0;
    while (line.size() > 1) {
      const Vector2d last = line.back();
      const Vector2d before = line[line.size() - 2];
      const double length = (last - before).norm();
      for (; back_steps < length; back_steps = std::max(2.0 * back_steps, 1.0)) {
        const Vector2d at = last + back_steps / length * (before - last);
        if (samples_.is_amid_water(rounded(at).cast<double>())) continue;
        line.back() = at;
        return;
      }
      line.pop_back();
      back_steps = 0.0;
    }
  }
  static double length_of(const std::vector<Vector2d>& line) {
    double length = 0.0;
    for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
    return length;
  }

  const Samples& samples_;
  const Strip& strip_;
  std::vector<double> stops_;
  std::vector<Vector2d> run_;         ///< in steps, as far as the last point of the strip
  Vector2d head_ = Vector2d::Zero();  ///< how far it goes
  double run_along_steps_ = 0.0;
  bool is_open_ = false;
  bool begins_cut_ = false;
  bool is_cut_ = false;
  std::vector<Strip> pieces_;
};

/// A ring within a box (Sutherland and Hodgman 1974): it may run along the box's sides, there and back, which even
/// and odd windings do not tell.
std::vector<Vector2d> within(std::vector<Vector2d> ring, const Vector2d& low,
                             const Vector2d& high) {
  for (const int axis : {0, 1})
    for (const double sign : {1.0, -1.0}) {
      const double border = sign > 0.0 ? low[axis] : high[axis];
      const auto inward = [&](const Vector2d& at) { return sign * (at[axis] - border); };
      std::vector<Vector2d> kept;
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Vector2d& a = ring[i];
        const Vector2d& b = ring[(i + 1) % ring.size()];
        if (inward(a) >= 0.0) kept.push_back(a);
        if ((inward(a) >= 0.0) == (inward(b) >= 0.0)) continue;
        kept.emplace_back(a + inward(a) / (inward(a) - inward(b)) * (b - a));
        kept.back()[axis] = border;
      }
      ring = std::move(kept);
    }
  return ring;
}

/// Cuts an area where the tile's samples are water; all in steps from the tile's corner.
class AreaCutter {
 public:
  AreaCutter(const Samples& samples, const world::Area& area)
      : samples_(samples),
        area_(area),
        corner_steps_(samples.first().cast<double>() * samples.spacing_steps()) {}

  /// Nothing where it stays as it is: it reaches over no water of the tile's square.
  std::optional<world::Area> cut() {
    if (!find_cells()) return std::nullopt;
    add_rings();
    const EvenOdd rings(edges_);
    add_shores();
    bool is_any_wet = false;
    const std::vector<RingsSteps> polygons = polygons_where(edges_, [&](const Vector2d& at) {
      if (!rings.contains(at)) return false;
      const bool is_dry = share_of_water(at) <= 0.5;
      is_any_wet = is_any_wet || !is_dry;
      return is_dry;
    });
    if (!is_any_wet) return std::nullopt;
    world::Area dry{.coating = area_.coating, .rings_steps = {}};
    for (const RingsSteps& polygon : polygons)
      for (const std::vector<Vector2i>& ring : polygon) {
        dry.rings_steps.push_back(ring);
        for (Vector2i& at : dry.rings_steps.back()) at += corner_steps_.cast<int>();
      }
    return dry;
  }

 private:
  /// Cells of the tile near the area; whether they have any water.
  bool find_cells() {
    Vector2d low = Vector2d::Constant(1e300);
    Vector2d high = -low;
    for (const auto& ring : area_.rings_steps)
      for (const Vector2i& at : ring) {
        low = low.cwiseMin(at.cast<double>() - corner_steps_);
        high = high.cwiseMax(at.cast<double>() - corner_steps_);
      }
    const double last = kTileCells * samples_.spacing_steps();
    if (!(low.array() < last && high.array() > 0.0).all()) return false;
    const auto cell = [&](const Vector2d& at) {
      return Vector2i((at / samples_.spacing_steps())
                          .array()
                          .floor()
                          .cwiseMax(0.0)
                          .cwiseMin(kTileCells - 1.0)
                          .cast<int>());
    };
    first_cell_ = cell(low);
    last_cell_ = cell(high);
    for (int j = first_cell_.y(); j <= last_cell_.y() + 1; ++j)
      for (int i = first_cell_.x(); i <= last_cell_.x() + 1; ++i)
        if (is_wet({i, j})) return true;
    return false;
  }

  void add_rings() {
    const Vector2d high = Vector2d::Constant(kTileCells * samples_.spacing_steps());
    for (const auto& ring : area_.rings_steps) {
      std::vector<Vector2d> corners;
      for (const Vector2i& at : ring) corners.emplace_back(at.cast<double>() - corner_steps_);
      corners = within(std::move(corners), Vector2d::Zero(), high);
      for (std::size_t i = 0; i < corners.size(); ++i)
        edges_.push_back({rounded(corners[i]), rounded(corners[(i + 1) % corners.size()])});
    }
  }

  /// Between middles of triangles' sides of which one end is water.
  void add_shores() {
    for (int j = first_cell_.y(); j <= last_cell_.y(); ++j)
      for (int i = first_cell_.x(); i <= last_cell_.x(); ++i) {
        const Vector2i east(i + 1, j), north(i, j + 1);
        for (const Vector2i& own : {Vector2i(i, j), Vector2i(i + 1, j + 1)}) {
          const std::array<Vector2i, 3> corners = {own, east, north};
          std::vector<Vector2i> middles;
          for (std::size_t k = 0; k < 3; ++k) {
            const Vector2i& a = corners[k];
            const Vector2i& b = corners[(k + 1) % 3];
            if (is_wet(a) != is_wet(b))
              middles.push_back(rounded(0.5 * samples_.spacing_steps() * (a + b).cast<double>()));
          }
          if (middles.size() == 2) edges_.push_back({middles[0], middles[1]});
        }
      }
  }

  bool is_wet(const Vector2i& own) const { return samples_.is_water(samples_.first() + own); }

  /// Of a triangle's corners, by their weights at a place.
  double share_of_water(const Vector2d& at) const {
    const Vector2d place = at / samples_.spacing_steps();
    const Vector2i cell =
        place.array().floor().cwiseMax(0.0).cwiseMin(kTileCells - 1.0).cast<int>();
    const Vector2d in_cell = place - cell.cast<double>();
    const double from_diagonal = 1.0 - in_cell.sum();
    const auto wet = [&](int i, int j) { return is_wet(cell + Vector2i(i, j)) ? 1.0 : 0.0; };
    if (from_diagonal >= 0.0)
      return from_diagonal * wet(0, 0) + in_cell.x() * wet(1, 0) + in_cell.y() * wet(0, 1);
    return -from_diagonal * wet(1, 1) + (1.0 - in_cell.y()) * wet(1, 0) +
           (1.0 - in_cell.x()) * wet(0, 1);
  }

  const Samples& samples_;
  const world::Area& area_;
  Vector2d corner_steps_;
  Vector2i first_cell_;
  Vector2i last_cell_;
  std::vector<std::array<Vector2i, 2>> edges_;
};

bool is_pier(const world::Coating& coating) {
  return coating.semantic_class == core::SemanticClass::Pier;
}

}  // namespace

void end_paint_at_water(world::Tile& tile,
                        const std::function<world::Cover(const Vector2d&)>& cover_at) {
  const Samples samples(tile, cover_at);
  std::vector<Strip> strips;
  for (Strip& strip : tile.objects.strips) {
    auto pieces = strip.coating.paving == world::Paving::Water ? std::nullopt
                                                               : StripCutter(samples, strip).cut();
    if (!pieces) {
      strips.push_back(std::move(strip));
      continue;
    }
    for (Strip& piece : *pieces) strips.push_back(std::move(piece));
  }
  tile.objects.strips = std::move(strips);
  if (!samples.has_water_in_square()) return;
  std::vector<world::Area> areas;
  for (world::Area& area : tile.objects.areas) {
    auto dry = area.coating.paving == world::Paving::Water || is_pier(area.coating)
                   ? std::nullopt
                   : AreaCutter(samples, area).cut();
    if (!dry) {
      areas.push_back(std::move(area));
      continue;
    }
    if (!dry->rings_steps.empty()) areas.push_back(std::move(*dry));
  }
  tile.objects.areas = std::move(areas);
}

}  // namespace terracast::tiler
