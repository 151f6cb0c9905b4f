#include "tiler/water/water_profile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/parallel.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Of a tributary where it comes down to its river: not steeper than that, it cuts in instead.
constexpr double kSteepestMouth = 0.15;
/// A line runs the other way where that fits the ground so much better, and by so much of height.
constexpr double kReversedFit = 0.25;
constexpr double kReversedRise_m = 1.0;
/// Pins that differ by less fit each other.
constexpr double kPinTolerance_m = 0.25;
/// Ends that are so near each other are one point.
constexpr double kJoin_m = 1.0 / 64.0;

using PointKey = std::pair<std::int64_t, std::int64_t>;
PointKey key_of(const Vector2d& point) {
  return {std::llround(point.x() / kJoin_m), std::llround(point.y() / kJoin_m)};
}

std::vector<Vector2d> densified(std::span<const Vector2d> points) {
  std::vector<Vector2d> dense{points.front()};
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vector2d way = points[i] - points[i - 1];
    const int count = std::max(1, static_cast<int>(std::ceil(way.norm() / kCourseStep_m)));
    for (int k = 1; k < count; ++k) dense.push_back(points[i - 1] + way * k / count);
    dense.push_back(points[i]);
  }
  return dense;
}

double misfit(std::span<const double> values) {
  const std::vector<double> fit = falling_fit(values);
  double sum = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i)
    sum += (values[i] - fit[i]) * (values[i] - fit[i]);
  return sum;
}

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

bool runs_backward(std::vector<double> heights_m) {
  const std::size_t half = heights_m.size() / 2;
  if (half == 0) return false;
  const std::span<const double> all(heights_m);
  if (mean(all.last(half)) - mean(all.first(half)) < kReversedRise_m) return false;
  const double forward = misfit(heights_m);
  std::reverse(heights_m.begin(), heights_m.end());
  return misfit(heights_m) < kReversedFit * forward;
}

/// Without the spikes of single samples: bridges, trees.
std::vector<double> median_of_five(const std::vector<double>& values) {
  std::vector<double> smooth(values.size());
  const auto last = static_cast<std::ptrdiff_t>(values.size()) - 1;
  for (std::ptrdiff_t i = 0; i <= last; ++i) {
    const std::ptrdiff_t reach = std::min({std::ptrdiff_t{2}, i, last - i});
    std::vector<double> window(values.begin() + (i - reach), values.begin() + (i + reach + 1));
    std::nth_element(window.begin(), window.begin() + reach, window.end());
    smooth[static_cast<std::size_t>(i)] = window[static_cast<std::size_t>(reach)];
  }
  return smooth;
}

/// A piece of a line between junctions, with its ground.
struct Piece {
  std::size_t line = 0;
  std::vector<Vector2d> points;
  std::vector<double> heights_m;
  std::vector<double> pins_m;  ///< NaN: none
  std::vector<double> levels_m;
  std::ptrdiff_t next = -1;  ///< piece downstream in the same chain
  bool has_previous = false;
};

class Network {
 public:
  Network(std::span<const Waterline> lines,
          const std::function<CourseGround(const Vector2d&)>& ground)
      : lines_(lines), ground_(ground) {
    // In an order of their own, whatever the order in which they came.
    order_.resize(lines.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return std::tuple(lines[a].number, lines[a].part) <
             std::tuple(lines[b].number, lines[b].part);
    });
  }

  WaterCourses fit() {
    split();
    measure();
    turn();
    chain();
    for (const std::vector<std::size_t>& chain : chains_) fit_chain(chain);
    for (Piece& piece : pieces_) {
      WaterCourse course;
      course.line = piece.line;
      course.is_in_lake.reserve(piece.points.size());
      for (const double pin_m : piece.pins_m)
        course.is_in_lake.push_back(std::isnan(pin_m) ? 0 : 1);
      course.points_world = std::move(piece.points);
      course.levels_m = std::move(piece.levels_m);
      found_.courses.push_back(std::move(course));
    }
    return std::move(found_);
  }

 private:
  void split() {
    std::map<PointKey, int> ends;
    for (const std::size_t line : order_) {
      ++ends[key_of(lines_[line].points_world.front())];
      ++ends[key_of(lines_[line].points_world.back())];
    }
    for (const std::size_t line : order_) {
      const std::vector<Vector2d>& points = lines_[line].points_world;
      std::size_t first = 0;
      for (std::size_t i = 1; i < points.size(); ++i) {
        if (i + 1 < points.size() && !ends.contains(key_of(points[i]))) continue;
        Piece piece;
        piece.line = line;
        piece.points = densified(std::span(points).subspan(first, i - first + 1));
        pieces_.push_back(std::move(piece));
        first = i;
      }
    }
  }

  void measure() {
    core::parallel_for(static_cast<std::int64_t>(pieces_.size()), [&](std::int64_t k) {
      Piece& piece = pieces_[static_cast<std::size_t>(k)];
      const double aside_m = 5.0 + lines_[piece.line].half_width_m;
      for (std::size_t i = 0; i < piece.points.size(); ++i) {
        const Vector2d along = piece.points[std::min(i + 1, piece.points.size() - 1)] -
                               piece.points[i == 0 ? 0 : i - 1];
        const Vector2d left = Vector2d(-along.y(), along.x()).normalized() * aside_m;
        const CourseGround here = ground_(piece.points[i]);
        double lowest_m = here.height_m;
        // Lines lie a little beside the valley's floor as the elevation has it.
        if (!here.level_m)
          lowest_m = std::min({lowest_m, ground_(piece.points[i] + left).height_m,
                               ground_(piece.points[i] - left).height_m});
        piece.heights_m.push_back(lowest_m);
        piece.pins_m.push_back(here.level_m.value_or(std::numeric_limits<double>::quiet_NaN()));
      }
    });
  }

  /// Lines are turned as a whole.
  void turn() {
    for (std::size_t first = 0; first < pieces_.size();) {
      std::size_t end = first;
      std::vector<double> heights_m;
      for (; end < pieces_.size() && pieces_[end].line == pieces_[first].line; ++end)
        heights_m.insert(heights_m.end(), pieces_[end].heights_m.begin(),
                         pieces_[end].heights_m.end());
      if (runs_backward(heights_m)) {
        ++found_.num_reversed;
        for (std::size_t k = first; k < end; ++k) {
          std::reverse(pieces_[k].points.begin(), pieces_[k].points.end());
          std::reverse(pieces_[k].heights_m.begin(), pieces_[k].heights_m.end());
          std::reverse(pieces_[k].pins_m.begin(), pieces_[k].pins_m.end());
        }
      }
      first = end;
    }
  }

  auto weight(std::size_t piece) const {
    const Waterline& line = lines_[pieces_[piece].line];
    return std::tuple(line.rank, line.half_width_m, line.points_world.size(), ~line.number);
  }

  /// At each point the greatest piece that comes in goes on in the one that is likest to it.
  void chain() {
    std::map<PointKey, std::pair<std::vector<std::size_t>, std::vector<std::size_t>>> nodes;
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      nodes[key_of(pieces_[k].points.front())].second.push_back(k);
      nodes[key_of(pieces_[k].points.back())].first.push_back(k);
    }
    const auto greatest = [&](const std::vector<std::size_t>& among) {
      return *std::max_element(among.begin(), among.end(),
                               [&](std::size_t a, std::size_t b) { return weight(a) < weight(b); });
    };
    for (auto& [key, node] : nodes) {
      auto& [in, out] = node;
      if (in.empty() || out.empty()) continue;
      const std::size_t comes = greatest(in);
      const auto likeness = [&](std::size_t goes) {
        const Waterline& a = lines_[pieces_[comes].line];
        const Waterline& b = lines_[pieces_[goes].line];
        return std::tuple(pieces_[comes].line == pieces_[goes].line,
                          !a.name.empty() && a.name == b.name, weight(goes));
      };
      const std::size_t goes = *std::max_element(
          out.begin(), out.end(),
          [&](std::size_t a, std::size_t b) { return likeness(a) < likeness(b); });
      if (comes == goes) continue;  // a ring
      pieces_[comes].next = static_cast<std::ptrdiff_t>(goes);
      pieces_[goes].has_previous = true;
    }
    std::vector<std::uint8_t> is_taken(pieces_.size(), 0);
    const auto take_from = [&](std::size_t first) {
      std::vector<std::size_t> chain;
      for (auto k = static_cast<std::ptrdiff_t>(first);
           k >= 0 && is_taken[static_cast<std::size_t>(k)] == 0;
           k = pieces_[static_cast<std::size_t>(k)].next) {
        is_taken[static_cast<std::size_t>(k)] = 1;
        chain.push_back(static_cast<std::size_t>(k));
      }
      if (!chain.empty()) chains_.push_back(std::move(chain));
    };
    for (std::size_t k = 0; k < pieces_.size(); ++k)
      if (!pieces_[k].has_previous) take_from(k);
    for (std::size_t k = 0; k < pieces_.size(); ++k) take_from(k);  // rings
    const auto size = [&](const std::vector<std::size_t>& chain) {
      std::size_t points = 0;
      int rank = 0;
      for (const std::size_t k : chain) {
        points += pieces_[k].points.size();
        rank = std::max(rank, lines_[pieces_[k].line].rank);
      }
      return std::pair(rank, points);
    };
    std::vector<std::pair<std::pair<int, std::size_t>, std::size_t>> by_size;
    for (std::size_t c = 0; c < chains_.size(); ++c) by_size.emplace_back(size(chains_[c]), c);
    std::stable_sort(by_size.begin(), by_size.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<std::vector<std::size_t>> sorted;
    for (const auto& [points, c] : by_size) sorted.push_back(std::move(chains_[c]));
    chains_ = std::move(sorted);
  }

  void fit_chain(const std::vector<std::size_t>& chain) {
    std::vector<double> targets_m;
    std::vector<double> pins_m;
    std::vector<double> way_m;
    double at_m = 0.0;
    for (const std::size_t k : chain) {
      Piece& piece = pieces_[k];
      const double below_m = freeboard_m(lines_[piece.line].half_width_m);
      for (std::size_t i = 0; i < piece.points.size(); ++i) {
        if (i > 0) at_m += (piece.points[i] - piece.points[i - 1]).norm();
        way_m.push_back(at_m);
        targets_m.push_back(piece.heights_m[i] - below_m);
        double pin_m = piece.pins_m[i];
        if (i == 0 || i + 1 == piece.points.size()) {
          const auto known = level_at_.find(key_of(piece.points[i]));
          if (known != level_at_.end()) pin_m = known->second;
        }
        pins_m.push_back(pin_m);
      }
    }
    std::vector<double> fit = falling_fit(median_of_five(targets_m));
    double upper_m = kInfinity;
    for (double& pin_m : pins_m) {
      if (std::isnan(pin_m)) continue;
      if (pin_m > upper_m + kPinTolerance_m) ++found_.num_conflicts;
      upper_m = pin_m = std::min(pin_m, upper_m);
    }
    upper_m = kInfinity;
    for (std::size_t i = 0; i < fit.size(); ++i) {
      if (!std::isnan(pins_m[i])) upper_m = pins_m[i];
      fit[i] = std::min(fit[i], upper_m);
    }
    double lower_m = -kInfinity;
    double lower_way_m = 0.0;
    for (std::size_t i = fit.size(); i-- > 0;) {
      if (!std::isnan(pins_m[i])) {
        fit[i] = lower_m = pins_m[i];
        lower_way_m = way_m[i];
        continue;
      }
      fit[i] = std::max(fit[i], lower_m);
      if (std::isfinite(lower_m))
        fit[i] = std::min(fit[i], lower_m + kSteepestMouth * (lower_way_m - way_m[i]) +
                                      std::max(0.0, lower_way_m - way_m[i] - 100.0));
    }
    std::size_t at = 0;
    for (const std::size_t k : chain) {
      Piece& piece = pieces_[k];
      if (at > 0) fit[at] = fit[at - 1];  // the same place
      piece.levels_m.assign(fit.begin() + static_cast<std::ptrdiff_t>(at),
                            fit.begin() + static_cast<std::ptrdiff_t>(at + piece.points.size()));
      at += piece.points.size();
      level_at_.emplace(key_of(piece.points.front()), piece.levels_m.front());
      level_at_.emplace(key_of(piece.points.back()), piece.levels_m.back());
    }
  }

  std::span<const Waterline> lines_;
  const std::function<CourseGround(const Vector2d&)>& ground_;
  std::vector<std::size_t> order_;
  std::vector<Piece> pieces_;
  std::vector<std::vector<std::size_t>> chains_;
  std::map<PointKey, double> level_at_;
  WaterCourses found_;
};

}  // namespace

std::vector<double> falling_fit(std::span<const double> values) {
  struct Pool {
    double sum;
    std::size_t count;
    double mean() const { return sum / static_cast<double>(count); }
  };
  std::vector<Pool> pools;
  for (const double value : values) {
    pools.push_back({value, 1});
    while (pools.size() > 1 && pools[pools.size() - 2].mean() < pools.back().mean()) {
      pools[pools.size() - 2].sum += pools.back().sum;
      pools[pools.size() - 2].count += pools.back().count;
      pools.pop_back();
    }
  }
  std::vector<double> fit;
  fit.reserve(values.size());
  for (const Pool& pool : pools) fit.insert(fit.end(), pool.count, pool.mean());
  return fit;
}

double freeboard_m(double half_width_m) {
  return std::clamp(0.25 * std::sqrt(half_width_m), 0.2, 1.5);
}

WaterCourses fit_courses(std::span<const Waterline> lines,
                         const std::function<CourseGround(const Vector2d&)>& ground) {
  return Network(lines, ground).fit();
}

}  // namespace terracast::tiler
