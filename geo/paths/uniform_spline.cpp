#include "geo/paths/uniform_spline.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "core/error.h"

namespace terracast::geo {
namespace {

std::size_t neighbour(long index, std::size_t count, bool is_closed) {
  const long n = static_cast<long>(count);
  if (is_closed) return static_cast<std::size_t>((index % n + n) % n);
  return static_cast<std::size_t>(std::clamp(index, 0L, n - 1));
}

/// Means over index - reach .. index + reach of what `padded` holds, whatever the reach at the cost
/// of a few additions each.
std::vector<double> box_mean(const std::vector<double>& padded, int reach) {
  // In blocks as wide as the window, each window is the end of a block and the start of the next:
  // no sum is longer than the window, so that rounding does not grow along the path.
  const std::size_t width = 2 * static_cast<std::size_t>(reach) + 1;
  const std::size_t count = padded.size();
  std::vector<double> from_block_start = padded;
  for (std::size_t i = 1; i < count; ++i)
    if (i % width != 0) from_block_start[i] += from_block_start[i - 1];
  std::vector<double> to_block_end = padded;
  for (std::size_t i = count - 1; i-- > 0;)
    if ((i + 1) % width != 0) to_block_end[i] += to_block_end[i + 1];
  std::vector<double> means(count - width + 1);
  for (std::size_t i = 0; i < means.size(); ++i) {
    const double next_block = i % width == 0 ? 0.0 : from_block_start[i + width - 1];
    means[i] = (to_block_end[i] + next_block) / static_cast<double>(width);
  }
  return means;
}

}  // namespace

UniformSpline::UniformSpline(std::vector<double> controls, double end, bool is_closed,
                             Continuity continuity)
    : controls_(std::move(controls)),
      num_intervals_(controls_.size() - (is_closed ? 0 : 1)),
      spacing_(end / static_cast<double>(num_intervals_)),
      is_closed_(is_closed),
      continuity_(continuity) {
  TERRACAST_CHECK(controls_.size() >= 2 && end > 0.0, "{} controls over {}", controls_.size(), end);
}

double UniformSpline::control(long index) const {
  return controls_[neighbour(index, controls_.size(), is_closed_)];
}

UniformSpline::Value UniformSpline::at(double u) const {
  const double x = u / spacing_;
  // The end itself, and what rounds past it, belongs to the last piece.
  const bool is_inside = u >= 0.0 && u <= spacing_ * static_cast<double>(num_intervals_);
  const double interval =
      is_inside ? std::clamp(std::floor(x), 0.0, static_cast<double>(num_intervals_ - 1))
                : std::floor(x);
  const double b = x - interval;
  const double a = 1.0 - b;
  const long i = static_cast<long>(interval);
  if (continuity_ == Continuity::Fourth) return quintic_at(i, b);
  const double c0 = control(i - 1), c1 = control(i), c2 = control(i + 1), c3 = control(i + 2);
  const double w1 = 4.0 - 6.0 * b * b + 3.0 * b * b * b;
  const double w2 = 4.0 - 6.0 * a * a + 3.0 * a * a * a;
  return {(a * a * a * c0 + w1 * c1 + w2 * c2 + b * b * b * c3) / 6.0,
          (a * a * (c1 - c0) + (2.0 * a * b * 1.0 + 1.0) * (c2 - c1) + b * b * (c3 - c2)) /
              (2.0 * spacing_),
          (a * (c0 - 2.0 * c1 + c2) + b * (c1 - 2.0 * c2 + c3)) / (spacing_ * spacing_),
          (c3 - 3.0 * c2 + 3.0 * c1 - c0) / (spacing_ * spacing_ * spacing_)};
}

// The piece as a polynomial of b: the columns of the uniform quintic basis.
UniformSpline::Value UniformSpline::quintic_at(long interval, double b) const {
  const double c0 = control(interval - 2), c1 = control(interval - 1), c2 = control(interval);
  const double c3 = control(interval + 1), c4 = control(interval + 2), c5 = control(interval + 3);
  const double k0 = (c0 + 26.0 * c1 + 66.0 * c2 + 26.0 * c3 + c4) / 120.0;
  const double k1 = (50.0 * (c3 - c1) + 5.0 * (c4 - c0)) / 120.0;
  const double k2 = (10.0 * (c0 + c4) + 20.0 * (c1 + c3) - 60.0 * c2) / 120.0;
  const double k3 = (10.0 * (c4 - c0) + 20.0 * (c1 - c3)) / 120.0;
  const double k4 = (5.0 * (c0 + c4) - 20.0 * (c1 + c3) + 30.0 * c2) / 120.0;
  const double k5 = (c5 - c0 + 5.0 * (c1 - c4) + 10.0 * (c3 - c2)) / 120.0;
  const double s = spacing_;
  return {k0 + b * (k1 + b * (k2 + b * (k3 + b * (k4 + b * k5)))),
          (k1 + b * (2.0 * k2 + b * (3.0 * k3 + b * (4.0 * k4 + b * 5.0 * k5)))) / s,
          (2.0 * k2 + b * (6.0 * k3 + b * (12.0 * k4 + b * 20.0 * k5))) / (s * s),
          (6.0 * k3 + b * (24.0 * k4 + b * 60.0 * k5)) / (s * s * s)};
}

std::vector<double> smoothed(const std::vector<double>& values, int reach, bool is_closed) {
  if (reach <= 0) return values;
  // A triangle is a box after a box.
  const int first = reach / 2;
  const int second = reach - first;
  std::vector<double> padded;
  padded.reserve(values.size() + 2 * static_cast<std::size_t>(reach));
  for (long i = -reach; i < static_cast<long>(values.size()) + reach; ++i)
    padded.push_back(values[neighbour(i, values.size(), is_closed)]);
  return box_mean(box_mean(padded, first), second);
}

std::vector<double> widened(const std::vector<double>& values, int reach, bool is_closed) {
  std::vector<double> result(values.size());
  std::deque<long> candidates;  // falling values, the largest of the window in front
  const auto value = [&](long i) { return values[neighbour(i, values.size(), is_closed)]; };
  for (long i = -reach; i < static_cast<long>(values.size()) + reach; ++i) {
    while (!candidates.empty() && value(candidates.back()) <= value(i)) candidates.pop_back();
    candidates.push_back(i);
    const long centre = i - reach;
    if (centre < 0) continue;
    while (candidates.front() < centre - reach) candidates.pop_front();
    result[static_cast<std::size_t>(centre)] = value(candidates.front());
  }
  return result;
}

}  // namespace terracast::geo
