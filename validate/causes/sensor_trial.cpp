#include "validate/causes/sensor_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "validate/geodesy.h"

namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Value at `at` of the polynomial through the numbers at 0, 1, … .
double extrapolate(const std::vector<double>& numbers, double at) {
  double sum = 0.0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    double weight = 1.0;
    for (std::size_t k = 0; k < numbers.size(); ++k)
      if (k != i)
        weight *= (at - static_cast<double>(k)) / (static_cast<double>(i) - static_cast<double>(k));
    sum += weight * numbers[i];
  }
  return sum;
}

/// Moves columns up by `late` rows, down where that is negative.
bool move_rows(SensorRecord& sensor, std::size_t first, std::size_t end, int late) {
  // More would carry the rounding of the Earth's coordinates too far.
  constexpr std::size_t kNodes = 5;
  const std::size_t count = sensor.times_s.size();
  const auto steps = static_cast<std::size_t>(std::abs(late));
  if (count < kNodes + steps) return false;
  const std::vector<double> wrong = sensor.values;
  for (std::size_t column = first; column < end; ++column) {
    const auto at = [&](std::size_t row) { return wrong[row * sensor.num_channels + column]; };
    const auto put = [&](std::size_t row, double value) {
      sensor.values[row * sensor.num_channels + column] = value;
    };
    std::vector<double> nodes;
    for (std::size_t i = 0; i < kNodes; ++i) nodes.push_back(late > 0 ? at(count - 1 - i) : at(i));
    for (std::size_t row = 0; row < count; ++row)
      if (late > 0 ? row + steps < count : row >= steps)
        put(row, at(late > 0 ? row + steps : row - steps));
    for (std::size_t i = 0; i < steps; ++i)
      put(late > 0 ? count - 1 - i : i,
          extrapolate(nodes, -static_cast<double>(steps) + static_cast<double>(i)));
  }
  if (late > 0)
    sensor.end_known = std::min(sensor.end_known, count - steps);
  else
    sensor.first_known = std::max(sensor.first_known, steps);
  return true;
}

std::vector<Matrix3d> signed_permutations() {
  std::vector<Matrix3d> all;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d m = Matrix3d::Zero();
      for (int row = 0; row < 3; ++row)
        m(row, order[static_cast<std::size_t>(row)]) = (signs >> row) % 2 == 0 ? 1.0 : -1.0;
      all.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

}  // namespace

bool SensorSymptoms::fails(std::string_view start) const {
  return std::any_of(shares.begin(), shares.end(), [&](const auto& entry) {
    return entry.second > 1.0 && std::string_view(entry.first).starts_with(start);
  });
}

SensorHypothesis simple_cause(const char* name, std::string words, int rank,
                              std::function<bool(SensorRecord&)> undo) {
  return {.rank = rank,
          .undo = [name, words = std::move(words), undo = std::move(undo)](SensorRecord& sensor,
                                                                           Cause& cause) {
            if (!undo(sensor)) return false;
            cause.name = name;
            cause.words = words;
            return true;
          }};
}

void add_late(const SensorSymptoms& symptoms, std::size_t first, std::size_t end, const char* what,
              std::vector<SensorHypothesis>& hypotheses) {
  if (end > symptoms.sensor.num_channels) return;
  for (const int late : {1, -1, 2, -2}) {
    SensorHypothesis h;
    h.rank = 1;
    h.undo = [=](SensorRecord& sensor, Cause& cause) {
      if (!move_rows(sensor, first, end, late)) return false;
      cause.name = "sensor_late";
      cause.size = late;
      cause.unit = "samples";
      cause.words = fmt::format("{} {} by {} sample{}: each row holds those of {:.6g} s {}", what,
                                late > 0 ? "are late" : "are early", std::abs(late),
                                std::abs(late) == 1 ? "" : "s", std::abs(late) / sensor.rate_hz,
                                late > 0 ? "before" : "after");
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

std::optional<Matrix3d> exchange_of_axes(const std::vector<VectorPair>& pairs) {
  static const std::vector<Matrix3d> all = signed_permutations();
  // The best, and the next best of them.
  std::array<std::pair<double, const Matrix3d*>, 2> best = {{{1e300, nullptr}, {1e300, nullptr}}};
  for (const Matrix3d& one : all) {
    double sum = 0.0;
    for (const VectorPair& pair : pairs) sum += (pair.wrong - one * pair.right).squaredNorm();
    if (sum < best[0].first) {
      best[1] = best[0];
      best[0] = {sum, &one};
    } else if (sum < best[1].first) {
      best[1] = {sum, &one};
    }
  }
  constexpr double kClear = 0.25;
  if (pairs.empty() || best[0].second == nullptr || !(best[0].first < kClear * best[1].first) ||
      best[0].second->isIdentity(0.0))
    return std::nullopt;
  return *best[0].second;
}

std::string words_of_axes(const Matrix3d& wrong_from_right) {
  std::string words = "x, y, z are ";
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      if (wrong_from_right(row, column) != 0.0)
        words += fmt::format("{}{}{}", row == 0 ? "" : ", ",
                             wrong_from_right(row, column) < 0.0 ? "-" : "", "xyz"[column]);
  return words;
}

std::vector<SampleAtFrame> samples_at_frames(const Sequence& sequence, const SensorRecord& sensor) {
  std::vector<SampleAtFrame> found;
  const Pose ecef_from_enu = ecef_from_local(sequence.origin);
  for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
    constexpr double kSameTime = 1e-9;
    const double frame = sensor.times_s[k] * sequence.rate_hz;
    if (std::abs(frame - std::round(frame)) > kSameTime ||
        frame > static_cast<double>(sequence.num_frames) - 0.5)
      continue;
    if (const auto body = local_from_body(sequence, static_cast<std::size_t>(std::lround(frame))))
      found.push_back({k, ecef_from_enu * *body});
  }
  return found;
}

}  // namespace terracast::validate
