#include "validate/readers/georegistration.h"

#include <fmt/format.h>

#include <algorithm>

#include "validate/causes/height_fault.h"
#include "validate/causes/trial.h"

/// COLMAP's georegistration.txt: metres where degrees are meant, other axes and units, heights above another surface,
/// places of other frames. The file stands beside the model, and no other check reads it: a cause is one that brings
/// all places to georeference.csv's.
namespace terracast::validate {

namespace {

using Eigen::Vector3d;
using Numbers = std::array<double, 3>;

/// A line of the file with the right place of its image.
struct Line {
  Numbers numbers;
  Geodetic right;
};

/// Lines of the trial's images, each as that of the frame so much later if that is there.
std::vector<Line> lines_of(const Trial& trial, const GeoregistrationPlaces& places, int shift) {
  std::vector<Line> lines;
  for (const Camera& camera : trial.sequence.cameras)
    for (int f = 0; f < static_cast<int>(camera.georeference.size()); ++f) {
      const int from = f - shift;
      if (from < 0 || from >= static_cast<int>(camera.georeference.size()) ||
          !camera.georeference[static_cast<std::size_t>(f)])
        continue;
      const auto found = places.find(
          fmt::format("{}/{}.png", camera.name, frame_digits(trial.first_frame + from)));
      if (found != places.end())
        lines.push_back({found->second, camera.georeference[static_cast<std::size_t>(f)]->place});
    }
  return lines;
}

/// What the numbers of a line may be instead of a place: its Earth-centred position, m.
using Reading = std::function<Vector3d(const Numbers&)>;

/// slope   what may be left for each metre from the first line's place
bool is_right(const std::vector<Line>& lines, const Reading& reading, double slope) {
  constexpr double kSame_m = 1e-3;
  return lines.size() > 1 && std::all_of(lines.begin(), lines.end(), [&](const Line& line) {
           const Vector3d right = ecef_from_geodetic(line.right);
           const double away_m = (right - ecef_from_geodetic(lines.front().right)).norm();
           return (reading(line.numbers) - right).norm() < kSame_m + slope * away_m;
         });
}

/// Adds the cause if it brings all lines where they belong.
void add(const std::vector<Line>& lines, std::vector<Hypothesis>& hypotheses, const char* name,
         const std::string& words, const Reading& reading, double size = 0.0, const char* unit = "",
         double slope = 0.0) {
  if (!is_right(lines, reading, slope)) return;
  Hypothesis h;
  h.checks = {"georegistration"};
  h.marks = {"georegistration"};
  h.rank = 1;
  h.undo = [=](Trial&, Cause& cause) {
    cause.name = name;
    cause.size = size;
    cause.unit = unit;
    cause.words = "georegistration.txt: " + words;
    return true;
  };
  hypotheses.push_back(std::move(h));
}

Vector3d ecef_of(double lat_deg, double lon_deg, double height_m) {
  return ecef_from_geodetic({lat_deg, lon_deg, height_m});
}

void add_axes(const Trial& trial, const std::vector<Line>& lines,
              std::vector<Hypothesis>& hypotheses) {
  add(lines, hypotheses, "place_axes",
      "places are Earth-centred x, y, z (ECEF) where latitude, longitude and height are meant",
      [](const Numbers& n) { return Vector3d(n[0], n[1], n[2]); });
  const Pose from_local = ecef_from_local(trial.sequence.origin);
  // Of one's own choice of origin are the first line's place, as model_aligner has it, and the sequence's.
  const Pose from_first = ecef_from_local(lines.front().right);
  for (const Pose& ecef_from_enu : {from_local, from_first}) {
    add(lines, hypotheses, "place_axes",
        "places are metres east, north, up where latitude, longitude and height are meant",
        [=](const Numbers& n) { return ecef_from_enu * Vector3d(n[0], n[1], n[2]); });
    add(lines, hypotheses, "place_axes",
        "places are metres north, east, down where latitude, longitude and height are meant",
        [=](const Numbers& n) { return ecef_from_enu * Vector3d(n[1], n[0], -n[2]); });
  }
  add(lines, hypotheses, "lat_lon_swapped", "latitude and longitude are swapped",
      [](const Numbers& n) { return ecef_of(n[1], n[0], n[2]); });
  add(lines, hypotheses, "place_unit",
      "latitude and longitude are in radians where degrees are meant", [](const Numbers& n) {
        return ecef_of(degrees_from_radians(n[0]), degrees_from_radians(n[1]), n[2]);
      });
  add(lines, hypotheses, "height_sign", "heights count downwards where upwards is meant",
      [](const Numbers& n) { return ecef_of(n[0], n[1], -n[2]); });
}

void add_heights(const Trial& trial, const std::vector<Line>& lines,
                 std::vector<Hypothesis>& hypotheses) {
  const double off_m = lines.front().numbers[2] - lines.front().right.height_m;
  const HeightFault fault = height_fault(trial, off_m);
  // A geoid is sloped against the ellipsoid by as much as plumb lines are: 100 arc-seconds beside the highest mountains.
  constexpr double kSlope = 5e-4;
  add(
      lines, hypotheses, fault == HeightFault::Geoid ? "geoid" : "height_offset",
      words_of_heights(fault, off_m, "", "the geoid's height added twice?"),
      [off_m](const Numbers& n) { return ecef_of(n[0], n[1], n[2] - off_m); }, off_m, "m", kSlope);
}

}  // namespace

void make_georegistration_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  if (!symptoms.fails("georegistration")) return;
  const std::string path = trial.sequence.path + "/georegistration.txt";
  GeoregistrationPlaces places;
  Findings ignored;
  ignored.attempt(path, [&] { places = read_georegistration(trial.dataset->root / path, path); });
  const std::vector<Line> lines = lines_of(trial, places, 0);
  if (lines.empty()) return;
  add_axes(trial, lines, hypotheses);
  add_heights(trial, lines, hypotheses);
  for (const int shift : {1, -1})
    add(
        lines_of(trial, places, shift), hypotheses, "georeference_shifted",
        fmt::format("places are shifted by 1 frame: each is that of the frame {}",
                    shift > 0 ? "after" : "before"),
        [](const Numbers& n) { return ecef_of(n[0], n[1], n[2]); }, shift, "frames");
}

}  // namespace terracast::validate
