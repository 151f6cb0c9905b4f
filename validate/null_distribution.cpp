#include "validate/null_distribution.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

namespace terracast::validate {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// From here on Student's distribution is the normal one to a relative 1e-7 of the tail at 1e-9.
constexpr double kManyDegrees = 1e9;
/// What is left of a quantile where the probability of being found is 99 of 100.
constexpr double kMissed = 0.02;

/// Below half a degree a tail of 1e-9 is beyond all that a double holds.
bool is_number_of_degrees(double degrees) { return degrees >= 0.5; }

using namespace boost::math::policies;
using Quiet =
    policy<overflow_error<ignore_error>, underflow_error<ignore_error>, promote_double<false>>;
using Student = boost::math::students_t_distribution<double, Quiet>;
using Normal = boost::math::normal_distribution<double, Quiet>;
using Binomial = boost::math::binomial_distribution<double, Quiet>;

}  // namespace

double student_tail(double deviations, double degrees) {
  if (!is_number_of_degrees(degrees)) return 1.0;
  const double size = std::abs(deviations);
  if (std::isinf(size)) return 0.0;
  if (degrees > kManyDegrees)
    return 2.0 * boost::math::cdf(boost::math::complement(Normal(), size));
  return 2.0 * boost::math::cdf(boost::math::complement(Student(degrees), size));
}

double student_quantile(double probability, double degrees) {
  if (!is_number_of_degrees(degrees)) return kInfinite;
  const double one_side = 0.5 * std::clamp(probability, std::numeric_limits<double>::min(), 1.0);
  if (degrees > kManyDegrees)
    return boost::math::quantile(boost::math::complement(Normal(), one_side));
  return boost::math::quantile(boost::math::complement(Student(degrees), one_side));
}

double binomial_tail(std::int64_t count, std::int64_t total, double share) {
  if (count <= 0) return 1.0;
  if (count > total || share <= 0.0) return 0.0;
  const Binomial distribution(static_cast<double>(total), std::min(share, 1.0));
  return boost::math::cdf(boost::math::complement(distribution, static_cast<double>(count - 1)));
}

std::int64_t binomial_quantile(double probability, std::int64_t total, double share) {
  std::int64_t low = 0, high = total;  // the tail of low + 1 or more counts is searched
  while (low < high) {
    const std::int64_t middle = low + (high - low) / 2;
    if (binomial_tail(middle + 1, total, share) < probability)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

namespace {

/// What a probability leaves of an error, in all.
double reach_of(double probability, const Estimate& estimate) {
  const double deviations = student_quantile(probability, estimate.degrees);
  return std::isinf(deviations) ? deviations : deviations * estimate.standard_error;
}

}  // namespace

double Estimates::share_of_verdict() const {
  return kFalseVerdict / static_cast<double>(std::max<std::size_t>(estimates_.size(), 1));
}

double Estimates::smallest(const Estimate& estimate) const {
  return estimate.allowance + reach_of(share_of_verdict(), estimate) + reach_of(kMissed, estimate);
}

std::size_t Estimates::num_seen() const {
  return static_cast<std::size_t>(
      std::count_if(estimates_.begin(), estimates_.end(),
                    [&](const Estimate& e) { return smallest(e) <= worth_finding_; }));
}

void Estimates::add_unseen(const std::string& part) {
  ++num_unseen_;
  parts_unknown_.insert(part);
}

std::vector<std::string> Estimates::unseen_parts() const {
  std::set<std::string> unseen = parts_unknown_;
  for (const Estimate& e : estimates_) unseen.insert(e.part);
  for (const Estimate& e : estimates_)
    if (smallest(e) <= worth_finding_) unseen.erase(e.part);
  unseen.erase("");
  return {unseen.begin(), unseen.end()};
}

void Estimates::judge(CheckResult& result) const {
  double least = kInfinite, most = 0.0, most_used = 0.0;
  std::pair<int, double> most_telling = {-1, 0.0};
  result.probability = 1.0;
  for (const Estimate& e : estimates_) {
    const double beyond = std::max(std::abs(e.value) - e.allowance, 0.0);
    const double bound = e.allowance + reach_of(share_of_verdict(), e);
    const double tail = beyond > 0.0 ? student_tail(beyond / e.standard_error, e.degrees) : 1.0;
    result.probability =
        std::min(*result.probability, static_cast<double>(estimates_.size()) * tail);
    const double size = smallest(e);
    least = std::min(least, size);
    const bool is_seen = size <= worth_finding_;
    if (is_seen) most = std::max(most, size);
    const double used = share_of_bound(std::abs(e.value), bound, false);
    most_used = std::max(most_used, used);
    const std::pair<int, double> telling = {used > 1.0 ? 2 : is_seen ? 1 : 0, used};
    if (telling <= most_telling) continue;
    most_telling = telling;
    result.value = std::abs(e.value);
    result.bound = bound;
    result.worst = fmt::format("{}: {:.3g} ± {:.1g}", e.where, e.value, e.standard_error);
  }
  result.ok = most_used <= 1.0;
  result.smallest = most > 0.0 ? most : least;
  result.is_unseen = result.ok && num_seen() == 0;
  result.skipped = result.is_unseen;
  if (!result.is_unseen) result.unseen_parts = unseen_parts();
}

namespace {

/// The share of which more than `count` of so many points are found in 99 of 100 cases.
double smallest_share(std::int64_t count, std::int64_t total) {
  if (count >= total) return kInfinite;
  double low = 0.0, high = 1.0;
  constexpr int kHalvings = 40;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (binomial_tail(count + 1, total, middle) < 1.0 - 0.5 * kMissed ? low : high) = middle;
  }
  return high;
}

}  // namespace

std::int64_t PointShares::num_points() const {
  std::int64_t sum = 0;
  for (const ShareOfPoints& part : parts_) sum += part.num_points;
  return sum;
}

void PointShares::judge(CheckResult& result) const {
  // A part of so few points that even all of them wrong would prove nothing cannot be judged.
  const auto tells = [&](const ShareOfPoints& part, double probability) {
    return binomial_tail(part.num_points, part.num_points, allowance_) < probability;
  };
  std::size_t num_telling = 0;
  for (const ShareOfPoints& part : parts_) num_telling += tells(part, kFalseVerdict) ? 1 : 0;
  const double probability =
      kFalseVerdict / static_cast<double>(std::max<std::size_t>(num_telling, 1));
  double most_used = -1.0, least_tail = 2.0, least = kInfinite, most = 0.0;
  result.unit = "share";
  result.probability = 1.0;
  for (const ShareOfPoints& part : parts_) {
    const auto total = static_cast<double>(std::max<std::int64_t>(part.num_points, 1));
    const bool is_telling = tells(part, probability);
    const std::int64_t count = binomial_quantile(probability, part.num_points, allowance_);
    const double tail =
        is_telling ? binomial_tail(part.num_wrong, part.num_points, allowance_) : 1.0;
    result.probability = std::min(
        *result.probability, static_cast<double>(std::max<std::size_t>(num_telling, 1)) * tail);
    const double size = smallest_share(count, part.num_points);
    least = std::min(least, size);
    if (size <= worth_finding_) most = std::max(most, size);
    const double value = static_cast<double>(part.num_wrong) / total;
    const double bound = static_cast<double>(count) / total;
    const double used = is_telling ? share_of_bound(value, bound, false) : 0.0;
    if (std::pair(-tail, used) <= std::pair(-least_tail, most_used)) continue;
    least_tail = tail;
    most_used = used;
    result.value = value;
    result.bound = bound;
    result.worst = fmt::format("{}: {} of {} points", part.where, part.num_wrong, part.num_points);
  }
  result.ok = most_used <= 1.0;
  result.smallest = most > 0.0 ? most : least;
  result.is_unseen = result.ok && !(most > 0.0);
  result.skipped = result.is_unseen;
}

}  // namespace terracast::validate
