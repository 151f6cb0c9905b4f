#include "tiler/void_filling.h"

#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"

namespace terracast::tiler {
namespace {

constexpr int kSweepsPerLevel = 60;

std::vector<std::size_t> members_of(const Grid<std::uint8_t>& is_member) {
  std::vector<std::size_t> members;
  for (std::size_t k = 0; k < is_member.values.size(); ++k)
    if (is_member.values[k] != 0) members.push_back(k);
  return members;
}

/// Gauss-Seidel sweeps of Laplace's equation, forth and back; what lies beyond the grid does not
/// pull.
void relax(Grid<double>& heights_m, const std::vector<std::size_t>& unknown, int num_sweeps) {
  const auto width = static_cast<std::size_t>(heights_m.width);
  const auto update = [&](std::size_t k) {
    const std::size_t i = k % width;
    const std::size_t j = k / width;
    double sum = 0.0;
    int count = 0;
    const auto pull = [&](std::size_t neighbour) {
      sum += heights_m.values[neighbour];
      ++count;
    };
    if (i > 0) pull(k - 1);
    if (i + 1 < width) pull(k + 1);
    if (j > 0) pull(k - width);
    if (j + 1 < static_cast<std::size_t>(heights_m.height)) pull(k + width);
    if (count > 0) heights_m.values[k] = sum / count;
  };
  for (int sweep = 0; sweep < num_sweeps; ++sweep) {
    if (sweep % 2 == 0)
      for (const std::size_t k : unknown) update(k);
    else
      for (std::size_t n = unknown.size(); n-- > 0;) update(unknown[n]);
  }
}

/// Coarse to fine: a coarse sample is the mean of the known ones it stands for, unknown when there
/// are none.
void solve(Grid<double>& heights_m, const Grid<std::uint8_t>& is_unknown) {
  const std::vector<std::size_t> unknown = members_of(is_unknown);
  if (unknown.empty()) return;
  TERRACAST_CHECK(unknown.size() < heights_m.values.size(), "no sample is known");
  Grid<double> coarse((heights_m.width + 1) / 2, (heights_m.height + 1) / 2, 0.0);
  Grid<std::uint8_t> coarse_is_unknown(coarse.width, coarse.height, 0);
  for (int j = 0; j < coarse.height; ++j)
    for (int i = 0; i < coarse.width; ++i) {
      double sum = 0.0;
      int count = 0;
      for (int dj = 0; dj < 2; ++dj)
        for (int di = 0; di < 2; ++di)
          if (heights_m.contains(2 * i + di, 2 * j + dj) &&
              is_unknown(2 * i + di, 2 * j + dj) == 0) {
            sum += heights_m(2 * i + di, 2 * j + dj);
            ++count;
          }
      if (count > 0)
        coarse(i, j) = sum / count;
      else
        coarse_is_unknown(i, j) = 1;
    }
  solve(coarse, coarse_is_unknown);
  for (const std::size_t k : unknown) {
    const auto i = static_cast<double>(k % static_cast<std::size_t>(heights_m.width));
    const auto j = static_cast<double>(k / static_cast<std::size_t>(heights_m.width));
    heights_m.values[k] = bilinear(coarse, {0.5 * i - 0.25, 0.5 * j - 0.25});
  }
  relax(heights_m, unknown, kSweepsPerLevel);
}

/// Replaces a line's values f(q) by the least of f(q) + (step (p - q))^2 over all q.
void take_lower_envelope(std::vector<double>& f, double step) {
  const double step2 = step * step;
  const int n = static_cast<int>(f.size());
  std::vector<int> v(f.size(), 0);
  std::vector<double> z(f.size() + 1);
  int k = 0;
  z[0] = -kNoStart_m2;
  z[1] = kNoStart_m2;
  const auto at = [&](int q) { return f[static_cast<std::size_t>(q)]; };
  const auto meet = [&](int q, int p) {
    return ((at(q) + step2 * static_cast<double>(q) * q) -
            (at(p) + step2 * static_cast<double>(p) * p)) /
           (2.0 * step2 * (q - p));
  };
  for (int q = 1; q < n; ++q) {
    double s = meet(q, v[static_cast<std::size_t>(k)]);
    while (k > 0 && s <= z[static_cast<std::size_t>(k)]) {
      --k;
      s = meet(q, v[static_cast<std::size_t>(k)]);
    }
    ++k;
    v[static_cast<std::size_t>(k)] = q;
    z[static_cast<std::size_t>(k)] = s;
    z[static_cast<std::size_t>(k) + 1] = kNoStart_m2;
  }
  std::vector<double> d(f.size());
  k = 0;
  for (int q = 0; q < n; ++q) {
    while (z[static_cast<std::size_t>(k) + 1] < q) ++k;
    const double dq = q - v[static_cast<std::size_t>(k)];
    d[static_cast<std::size_t>(q)] = step2 * dq * dq + at(v[static_cast<std::size_t>(k)]);
  }
  f = d;
}

}  // namespace

Regions find_regions(const Grid<std::uint8_t>& is_member) {
  Regions found;
  found.label = Grid<std::int32_t>(is_member.width, is_member.height, 0);
  std::vector<std::pair<int, int>> stack;
  for (int row = 0; row < is_member.height; ++row)
    for (int column = 0; column < is_member.width; ++column) {
      if (is_member(column, row) == 0 || found.label(column, row) != 0) continue;
      found.regions.emplace_back();
      Regions::Region& region = found.regions.back();
      const auto label = static_cast<std::int32_t>(found.regions.size());
      found.label(column, row) = label;
      stack.assign(1, {column, row});
      while (!stack.empty()) {
        const auto [i, j] = stack.back();
        stack.pop_back();
        ++region.num_samples;
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di) {
            if (!is_member.contains(i + di, j + dj)) {
              region.touches_border = true;
              continue;
            }
            if (is_member(i + di, j + dj) == 0 || found.label(i + di, j + dj) != 0) continue;
            found.label(i + di, j + dj) = label;
            stack.emplace_back(i + di, j + dj);
          }
      }
    }
  return found;
}

void fill_from_surroundings(Grid<double>& heights_m, const Grid<std::uint8_t>& is_unknown) {
  const std::vector<std::size_t> unknown = members_of(is_unknown);
  if (unknown.empty()) return;
  solve(heights_m, is_unknown);
  // Coarse samples saw more than the rim: each region is held within its rim's range, then smoothed
  // again.
  const Regions regions = find_regions(is_unknown);
  std::vector<double> lowest_m(regions.regions.size(), std::numeric_limits<double>::infinity());
  std::vector<double> highest_m(regions.regions.size(), -std::numeric_limits<double>::infinity());
  for (int j = 0; j < heights_m.height; ++j)
    for (int i = 0; i < heights_m.width; ++i) {
      const std::int32_t label = regions.label(i, j);
      if (label == 0) continue;
      const auto region = static_cast<std::size_t>(label - 1);
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di)
          if (heights_m.contains(i + di, j + dj) && is_unknown(i + di, j + dj) == 0) {
            lowest_m[region] = std::min(lowest_m[region], heights_m(i + di, j + dj));
            highest_m[region] = std::max(highest_m[region], heights_m(i + di, j + dj));
          }
    }
  for (const std::size_t k : unknown) {
    const auto region = static_cast<std::size_t>(regions.label.values[k] - 1);
    heights_m.values[k] = std::clamp(heights_m.values[k], lowest_m[region], highest_m[region]);
  }
  relax(heights_m, unknown, kSweepsPerLevel / 2);
}

Grid<double> least_squared_distance(Grid<double> start_m2, const Eigen::Vector2d& sample_size) {
  // The lower envelope of parabolas, along columns, then rows.
  Grid<double>& least_m2 = start_m2;
  std::vector<double> line(static_cast<std::size_t>(least_m2.height));
  for (int i = 0; i < least_m2.width; ++i) {
    for (int j = 0; j < least_m2.height; ++j) line[static_cast<std::size_t>(j)] = least_m2(i, j);
    take_lower_envelope(line, sample_size.y());
    for (int j = 0; j < least_m2.height; ++j) least_m2(i, j) = line[static_cast<std::size_t>(j)];
  }
  line.resize(static_cast<std::size_t>(least_m2.width));
  for (int j = 0; j < least_m2.height; ++j) {
    for (int i = 0; i < least_m2.width; ++i) line[static_cast<std::size_t>(i)] = least_m2(i, j);
    take_lower_envelope(line, sample_size.x());
    for (int i = 0; i < least_m2.width; ++i) least_m2(i, j) = line[static_cast<std::size_t>(i)];
  }
  return start_m2;
}

Grid<float> distance_to_others(const Grid<std::uint8_t>& is_member,
                               const Eigen::Vector2d& sample_size) {
  Grid<double> start_m2(is_member.width, is_member.height, 0.0);
  for (std::size_t k = 0; k < start_m2.values.size(); ++k)
    if (is_member.values[k] != 0) start_m2.values[k] = kNoStart_m2;
  const Grid<double> squared = least_squared_distance(std::move(start_m2), sample_size);
  Grid<float> distance(is_member.width, is_member.height);
  for (std::size_t k = 0; k < squared.values.size(); ++k)
    distance.values[k] = static_cast<float>(std::sqrt(squared.values[k]));
  return distance;
}

}  // namespace terracast::tiler
