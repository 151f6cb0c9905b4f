#include <fmt/format.h>

#include <cmath>

#include "validate/checks/checker.h"
#include "validate/checks/sensor_clocks.h"
#include "validate/null_distribution.h"

/// timestamps.csv against the clocks of calibration_true.json, and stamps of sensors beside cameras against sensors.json.
namespace terracast::validate {

namespace {

class ClocksChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    std::vector<CheckResult> results = {of_cameras(sequence)};
    for (CheckResult& result : compare_sensor_clocks(dataset, sequence))
      results.push_back(std::move(result));
    return results;
  }

 private:
  static CheckResult of_cameras(const Sequence& sequence) {
    CheckResult result;
    result.name = "clocks";
    result.unit = "of what the jitter allows";
    result.bound = 1.0;
    std::int64_t num_stamps = 0;
    for (const Camera& camera : sequence.cameras) num_stamps += std::ssize(camera.stamps_s);
    for (const Camera& camera : sequence.cameras)
      for (std::size_t i = 0; i < camera.stamps_s.size() && i < camera.georeference.size(); ++i)
        if (camera.georeference[i])
          compare(camera, i, camera.georeference[i]->time_s, num_stamps, result);
    if (num_stamps == 0) return skipped_result("clocks", "the clocks of all cameras show the time");
    result.ok = result.is_within_bound();
    result.summary = fmt::format(
        "{} stamps of timestamps.csv against t + offset_s + drift t of calibration_true.json.",
        num_stamps);
    result.reason =
        "Stamps have nine decimals; the largest of as many normal deviates of jitter_sd_s is "
        "beyond this with a probability of 1e-9.";
    result.detects = "stamps of another camera or frame; 1 ns where a clock does not jitter";
    return result;
  }

  static void compare(const Camera& camera, std::size_t frame, double time_s,
                      std::int64_t num_stamps, CheckResult& result) {
    // Half a nanosecond of each of the two times, and the doubles' rounding.
    constexpr double kRounding_s = 1.1e-9;
    constexpr double kNormal = 1e12;  // degrees of freedom
    const StatedClock clock = camera.clock.value_or(StatedClock{});
    const double off_s = camera.stamps_s[frame] - (time_s + clock.offset_s + clock.drift * time_s);
    const double allowed_s =
        kRounding_s +
        clock.jitter_sd_s *
            student_quantile(kFalseVerdict / static_cast<double>(num_stamps), kNormal);
    note_worst(result, std::abs(off_s) / allowed_s,
               fmt::format("{}, frame {}: {:.3g} s off", camera.name, frame, off_s));
  }
};

}  // namespace

std::unique_ptr<Checker> make_clocks_check(const ValidateOptions&) {
  return std::make_unique<ClocksChecker>();
}

}  // namespace terracast::validate
