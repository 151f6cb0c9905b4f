#include "validate/checks/single_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "validate/geometry.h"
#include "validate/sampling.h"

namespace terracast::validate {

namespace {

using Row = std::optional<Pose>;

/// Steps about a row, s[1] to it and s[2] from it; s[0] and s[3] where there are such rows.
struct Steps {
  std::array<Eigen::Vector3d, 4> s;
  bool has_before = false, has_after = false;

  /// From where the others put the row to where it is, m.
  double off_m() const {
    if (has_before && has_after) return (s[0] - 3.0 * s[1] + 3.0 * s[2] - s[3]).norm() / 6.0;
    return (has_before ? s[0] - 2.0 * s[1] + s[2] : s[1] - 2.0 * s[2] + s[3]).norm() / 3.0;
  }
};

/// The longest step beside a row, without the row itself.
double longest_m(const Steps& steps) {
  double longest = 0.5 * (steps.s[1] + steps.s[2]).norm();
  if (steps.has_before) longest = std::max(longest, steps.s[0].norm());
  if (steps.has_after) longest = std::max(longest, steps.s[3].norm());
  return longest;
}

Eigen::Vector3d step_m(const Pose& from, const Pose& to, bool is_in_own_axes) {
  const Eigen::Vector3d step = to.translation - from.translation;
  if (!is_in_own_axes) return step;
  return halfway(from.rotation, to.rotation).transpose() * step;
}

bool has_row(const std::vector<Row>& rows, std::size_t row) {
  return row < rows.size() && rows[row].has_value();
}

std::optional<Steps> steps_about(const std::vector<Row>& rows, std::size_t row,
                                 bool is_in_own_axes) {
  if (row == 0 || !has_row(rows, row - 1) || !has_row(rows, row) || !has_row(rows, row + 1))
    return std::nullopt;
  Steps steps;
  steps.has_before = row >= 2 && has_row(rows, row - 2);
  steps.has_after = has_row(rows, row + 2);
  if (!steps.has_before && !steps.has_after) return std::nullopt;
  if (steps.has_before) steps.s[0] = step_m(*rows[row - 2], *rows[row - 1], is_in_own_axes);
  steps.s[1] = step_m(*rows[row - 1], *rows[row], is_in_own_axes);
  steps.s[2] = step_m(*rows[row], *rows[row + 1], is_in_own_axes);
  if (steps.has_after) steps.s[3] = step_m(*rows[row + 1], *rows[row + 2], is_in_own_axes);
  return steps;
}

/// The median step, m: a row beside which nothing moves is compared with it.
double typical_step_m(const std::vector<Row>& rows) {
  std::vector<double> steps;
  for (std::size_t i = 0; i + 1 < rows.size(); ++i)
    if (rows[i] && rows[i + 1])
      steps.push_back((rows[i + 1]->translation - rows[i]->translation).norm());
  // Poses of six decimals are half a micrometre off.
  constexpr double kRounding_m = 1e-5;
  return std::max(median(steps), kRounding_m);
}

/// Nothing for a row without neighbours enough.
std::optional<double> off_steps(const std::vector<Row>& rows, std::size_t row, double typical_m) {
  std::optional<double> least;
  for (const bool is_in_own_axes : {false, true})
    if (const std::optional<Steps> steps = steps_about(rows, row, is_in_own_axes)) {
      const double off = steps->off_m() / std::max(longest_m(*steps), typical_m);
      least = std::min(least.value_or(off), off);
    }
  return least;
}

/// What all rows of a steady path are within, in steps. Of few rows noise is steady by chance: of five rows with
/// independent noise one path in 180 to within 0.2, of six one in 8000, of seven one in 300 000; it is as much less
/// as makes that 1e-9, as chance falls with the third power of it for each row more than four.
double steady_steps(const std::vector<Row>& rows) {
  constexpr std::size_t kFewest = 5;
  constexpr std::array<double, 6> kSteady = {0.001, 0.03, 0.08, 0.13, 0.18, 0.2};
  const auto count = static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [](const Row& row) { return row.has_value(); }));
  return count < kFewest ? 0.0 : kSteady[std::min(count - kFewest, kSteady.size() - 1)];
}

/// Whether all rows but one fit, and the path moves all along, so that a row can be told.
bool is_steady(const std::vector<Row>& rows, std::size_t but) {
  const double typical_m = typical_step_m(rows), most_steps = steady_steps(rows);
  double shortest_m = std::numeric_limits<double>::infinity(), longest_m = 0.0;
  for (std::size_t row = 0; row + 1 < rows.size(); ++row) {
    if (!rows[row] || !rows[row + 1]) continue;
    const double length_m = step_m(*rows[row], *rows[row + 1], false).norm();
    shortest_m = std::min(shortest_m, length_m);
    longest_m = std::max(longest_m, length_m);
    if (row == but) continue;
    const std::optional<double> off = off_steps(rows, row, typical_m);
    if (off && *off > most_steps) return false;
  }
  constexpr double kMovesAllAlong = 0.3;
  return shortest_m > kMovesAllAlong * longest_m;
}

/// The path with a row where its neighbours put it.
std::vector<Row> without(std::vector<Row> rows, std::size_t row) {
  const auto steps = steps_about(rows, row, false);
  if (!steps) return rows;
  const auto& s = steps->s;
  Eigen::Vector3d off;
  if (steps->has_before && steps->has_after)
    off = (s[0] - 3.0 * s[1] + 3.0 * s[2] - s[3]) / 6.0;
  else if (steps->has_before)
    off = (s[0] - 2.0 * s[1] + s[2]) / 3.0;
  else
    off = -(s[1] - 2.0 * s[2] + s[3]) / 3.0;
  rows[row]->translation += off;
  rows[row]->rotation = halfway(rows[row - 1]->rotation, rows[row + 1]->rotation);
  return rows;
}

std::vector<Row> exchanged(std::vector<Row> rows, std::size_t row) {
  std::swap(rows[row], rows[row + 1]);
  return rows;
}

/// The row after a single step that is many times as long as every other one, on a path that moves all along.
std::optional<OddRow> find_leap(const std::vector<Row>& rows) {
  std::vector<double> steps;
  OddRow leap;
  for (std::size_t row = 0; row + 1 < rows.size(); ++row) {
    if (!rows[row] || !rows[row + 1]) continue;
    steps.push_back(step_m(*rows[row], *rows[row + 1], false).norm());
    if (steps.back() > leap.steps) leap = {row + 1, steps.back()};
  }
  constexpr std::size_t kEnough = 5;
  constexpr double kTimes = 10.0, kMovesAllAlong = 0.3;
  if (steps.size() < kEnough) return std::nullopt;
  std::sort(steps.begin(), steps.end());
  const double second_m = steps[steps.size() - 2];
  if (leap.steps <= kTimes * std::max(second_m, typical_step_m(rows)) ||
      steps.front() <= kMovesAllAlong * second_m)
    return std::nullopt;
  leap.steps /= second_m;
  return leap;
}

}  // namespace

SingleRows find_single_rows(const std::vector<Row>& rows) {
  SingleRows found;
  const double typical_m = typical_step_m(rows);
  for (std::size_t row = 1; row + 1 < rows.size(); ++row) {
    const std::optional<double> off = off_steps(rows, row, typical_m);
    if (!off) continue;
    ++found.num_rows;
    if (*off > found.farthest.steps || found.num_rows == 1) found.farthest = {row, *off};
  }
  if (found.farthest.steps <= kOddRow_steps) return found;
  if (const std::optional<OddRow> leap = find_leap(rows)) {
    found.farthest = *leap;
    found.is_spoilt = true;
    return found;
  }
  // Two rows that changed places may leave a row beside them farther off than themselves.
  constexpr std::size_t kNone = 0;  // no window is about the first row
  const std::size_t first = std::max<std::size_t>(found.farthest.row, 2) - 1;
  for (std::size_t row = first; row <= first + 3 && row < rows.size() && !found.is_spoilt; ++row) {
    if (!rows[row]) continue;
    found.is_spoilt = (row == found.farthest.row && is_steady(without(rows, row), row)) ||
                      (rows[row - 1] && is_steady(exchanged(rows, row - 1), kNone));
  }
  return found;
}

}  // namespace terracast::validate
