#include "validate/readers/georegistration.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "validate/checks/checker.h"

/// COLMAP's georegistration.txt, by which `model_aligner` brings a reconstruction to WGS84, against georeference.csv.
namespace terracast::validate {

namespace {

bool is_place(const std::array<double, 3>& numbers) {
  constexpr double kFarthest_m = 1e6;
  return std::abs(numbers[0]) <= 90.0 && std::abs(numbers[1]) <= 360.0 &&
         std::abs(numbers[2]) < kFarthest_m;
}

class GeoregistrationChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    CheckResult position;
    position.name = "georegistration_position";
    position.bound = 1e-3;
    position.unit = "m";
    const std::string path = sequence.path + "/georegistration.txt";
    if (dataset.format != "colmap" || !std::filesystem::is_regular_file(dataset.root / path))
      return {skipped_result(position.name, "the dataset holds no georegistration.txt")};
    std::size_t num_compared = 0;
    Findings damage;
    damage.attempt(path, [&] {
      const GeoregistrationPlaces places = read_georegistration(dataset.root / path, path);
      for (const Camera& camera : sequence.cameras)
        for (std::size_t frame = 0; frame < camera.georeference.size(); ++frame) {
          if (!camera.georeference[frame]) continue;
          const std::string name =
              fmt::format("{}/{}.png", camera.name, frame_digits(static_cast<int>(frame)));
          const std::string where = fmt::format("{}, frame {}", camera.name, frame);
          const auto found = places.find(name);
          ++num_compared;
          if (found == places.end() || !is_place(found->second)) {
            note_worst(position, std::numeric_limits<double>::infinity(),
                       where + (found == places.end() ? " is missing" : ": no place on Earth"));
            continue;
          }
          const auto& [lat_deg, lon_deg, height_m] = found->second;
          note_worst(position,
                     (ecef_from_geodetic({lat_deg, lon_deg, height_m}) -
                      ecef_from_geodetic(camera.georeference[frame]->place))
                         .norm(),
                     where);
        }
    });
    position.ok = position.is_within_bound() && damage.count() == 0;
    if (damage.count() > 0) {
      position.value = std::numeric_limits<double>::max();
      position.worst = damage.lines().front();
    }
    position.summary = fmt::format(
        "Places of {} images in georegistration.txt against georeference.csv.", num_compared);
    position.reason = "13 decimals of a degree are 1e-8 m, six of a metre 1e-6 m.";
    position.detects =
        "2 mm; heights above the geoid; latitude for longitude; metres where degrees are meant";
    if (num_compared == 0 && damage.count() == 0)
      return {unseen_result(position.name, "no image has a row in georeference.csv")};
    return {std::move(position)};
  }
};

}  // namespace

std::unique_ptr<Checker> make_georegistration_check(const ValidateOptions&) {
  return std::make_unique<GeoregistrationChecker>();
}

}  // namespace terracast::validate
