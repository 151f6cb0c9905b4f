#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "validate/check.h"

/// What a value is in a right dataset, and how it scatters: a verdict is wrong with a probability that is known.
///
/// A check that measures does not compare with a number that suited some dataset. It says by how much a right dataset
/// of this kind may be off (its allowance: what interpolation and rounding leave however much is measured), and what
/// the value's standard error is here, from how much its parts scatter. It fails where a right dataset shows such a
/// value with a probability below kFalseVerdict.
namespace terracast::validate {

/// The probability up to which a right dataset's value is called wrong, of each result.
inline constexpr double kFalseVerdict = 1e-9;

/// P(|T| > deviations) of Student's distribution; good to a relative 1e-6, tested down to tails of 1e-13. The
/// normal distribution beyond 1e9 degrees of freedom; 1 below half a degree.
double student_tail(double deviations, double degrees);
/// The deviations that it exceeds with a probability; +inf below half a degree of freedom.
double student_quantile(double probability, double degrees);
/// P(X >= count) of `total` independent events of probability `share`; good to a relative 1e-9.
double binomial_tail(std::int64_t count, std::int64_t total, double share);
/// The least count that is exceeded with less than a probability.
std::int64_t binomial_quantile(double probability, std::int64_t total, double share);

/// One figure that is 0 in a right dataset but for what it is allowed and its error.
struct Estimate {
  double value = 0.0;
  double standard_error = 0.0;
  double degrees = 0.0;    ///< of freedom, of the standard error
  double allowance = 0.0;  ///< the most that it is off by in a right dataset besides
  std::string where;
  std::string part =
      {};  ///< of the dataset, such as a camera, of which it is one of all there are; empty: none
};

/// Estimates of one kind, judged together: the more there are, the farther the farthest is.
class Estimates {
 public:
  /// worth_finding   the smallest error that this kind of check is for: an estimate that could not tell it is not seen
  explicit Estimates(double worth_finding) : worth_finding_(worth_finding) {}

  void add(Estimate estimate) { estimates_.push_back(std::move(estimate)); }
  /// One of which nothing is known, of a part.
  void add_unseen(const std::string& part = {});

  /// Sets value, bound, ok, probability, smallest and worst by the estimate that is farthest beyond its bound, or else,
  /// of those that could tell what is worth finding, next to it; unseen where none could, and none is beyond its bound.
  /// Parts of which none could are its `unseen_parts`.
  void judge(CheckResult& result) const;
  std::size_t num_seen() const;
  std::vector<std::string> unseen_parts() const;
  std::size_t num_all() const { return estimates_.size() + num_unseen_; }

 private:
  double share_of_verdict() const;
  /// The size that is found in 99 of 100 cases.
  double smallest(const Estimate& estimate) const;

  double worth_finding_;
  std::size_t num_unseen_ = 0;
  std::vector<Estimate> estimates_;
  std::set<std::string> parts_unknown_;  ///< of which something is not known
};

/// Of points that were drawn at random, or all there are, those that contradict.
struct ShareOfPoints {
  std::int64_t num_wrong = 0;
  std::int64_t num_points = 0;
  std::string where;
};

/// Judges shares of wrong points, one for each part of a dataset, such as a pair of images. In a right dataset a share is
/// an allowance at most: what slips between pixels. Of few points more may be wrong by chance.
class PointShares {
 public:
  /// worth_finding   the smallest share that this kind of check is for: a part that could not tell it is not seen
  PointShares(double allowance, double worth_finding)
      : allowance_(allowance), worth_finding_(worth_finding) {}

  void add(ShareOfPoints part) { parts_.push_back(std::move(part)); }

  /// Sets value, bound, ok, probability, smallest, unit and worst by the part that is least probable; unseen where none
  /// could tell what is worth finding, and none is beyond its bound.
  void judge(CheckResult& result) const;
  bool empty() const { return parts_.empty(); }
  std::int64_t num_points() const;

 private:
  double allowance_;
  double worth_finding_;
  std::vector<ShareOfPoints> parts_;
};

}  // namespace terracast::validate
