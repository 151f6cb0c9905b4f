#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "tests/validate/mutations/edits.h"

/// COLMAP's points elsewhere than their observations see them; its places for model_aligner.
namespace terracast::test {

namespace {

/// Words of a line of georegistration.txt: a name and three numbers.
using Place = std::array<double, 3>;
void edit_places(const RightDataset& d, const fs::path& folder,
                 const std::function<Place(const Place&)>& change) {
  const fs::path file = folder / sequence_path(d) / "georegistration.txt";
  std::vector<std::string> lines = lines_of(file);
  for (std::string& line : lines) {
    const std::size_t blank = line.find(' ');
    const std::vector<double> n = numbers_of(line.substr(blank));
    const Place place = change({n[0], n[1], n[2]});
    line = line.substr(0, blank) +
           fmt::format(" {:.13f} {:.13f} {:.6f}", place[0], place[1], place[2]);
  }
  write_lines(file, lines);
}

}  // namespace

void add_point_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list, true);
  const auto move_points = [](const std::function<Vector3d(const Vector3d&)>& change) {
    return [change](const RightDataset& d, const fs::path& folder) {
      Mistake mistake;
      mistake.colmap.written_point = change;
      write_colmap(d.recording, folder, mistake);
    };
  };
  add("PointsMoved", {"colmap"},
      move_points([](const Vector3d& p) -> Vector3d { return p + Vector3d(1.5, -2.0, 0.5); }),
      says({"points3D are moved by (1.5, -2, 0.5) m"}, Vector3d(1.5, -2.0, 0.5).norm(), 1e-6));
  add("PointsScaled", {"colmap"},
      move_points([](const Vector3d& p) -> Vector3d { return 1.02 * p; }),
      says({"points3D are scaled by 1.02"}, 1.02, 1e-8));
  add("PointsInMillimetres", {"colmap"},
      move_points([](const Vector3d& p) -> Vector3d { return 1000.0 * p; }),
      says({"points3D are in millimetres where metres are meant"}, 1000.0, 1e-5));
  add("PointsInNed", {"colmap"}, move_points([](const Vector3d& p) -> Vector3d {
        return {p.y(), p.x(), -p.z()};
      }),
      says({"points3D stand in north, east, down where east, north, up is meant"}));
  add("PointsTurned", {"colmap"}, move_points([](const Vector3d& p) -> Vector3d {
        return Eigen::AngleAxisd(0.5 * std::numbers::pi / 180.0, Vector3d::UnitZ()) * p;
      }),
      says({"points3D are turned by 0.5 deg"}, 0.5, 1e-6));

  const auto change_places = [](const std::function<Place(const Place&)>& change) {
    return
        [change](const RightDataset& d, const fs::path& folder) { edit_places(d, folder, change); };
  };
  add("RegistrationInEcef", {"colmap"}, change_places([](const Place& p) -> Place {
        const Vector3d at = ecef_of({p[0], p[1], p[2]});
        return {at.x(), at.y(), at.z()};
      }),
      says({"georegistration.txt: places are Earth-centred x, y, z (ECEF)"}));
  add("RegistrationInEnu", {"colmap"}, change_places([](const Place& p) -> Place {
        const Vector3d at = scene_from_place({p[0], p[1], p[2]});
        return {at.x(), at.y(), at.z()};
      }),
      says({"georegistration.txt: places are metres east, north, up"}));
  add("RegistrationInNed", {"colmap"}, change_places([](const Place& p) -> Place {
        const Vector3d at = scene_from_place({p[0], p[1], p[2]});
        return {at.y(), at.x(), -at.z()};
      }),
      says({"georegistration.txt: places are metres north, east, down"}));
  add("RegistrationLatitudeForLongitude", {"colmap"}, change_places([](const Place& p) -> Place {
        return {p[1], p[0], p[2]};
      }),
      says({"georegistration.txt: latitude and longitude are swapped"}));
  add("RegistrationInRadians", {"colmap"}, change_places([](const Place& p) -> Place {
        const double rad = std::numbers::pi / 180.0;
        return {rad * p[0], rad * p[1], p[2]};
      }),
      says({"georegistration.txt: latitude and longitude are in radians"}));
  add("RegistrationAboveGeoid", {"colmap"}, change_places([](const Place& p) -> Place {
        return {p[0], p[1], p[2] - kUndulation_m};
      }),
      says({"georegistration.txt: heights are above the geoid", "52.8 m too low"}, -kUndulation_m,
           0.01));
  add("RegistrationHeightsDown", {"colmap"}, change_places([](const Place& p) -> Place {
        return {p[0], p[1], -p[2]};
      }),
      says({"georegistration.txt: heights count downwards"}));
  add("RegistrationTooHigh", {"colmap"}, change_places([](const Place& p) -> Place {
        return {p[0], p[1], p[2] + 48.2};
      }),
      says({"georegistration.txt: heights are 48.2 m too high"}, 48.2, 0.01));
  add(
      "RegistrationOfOtherFrame", {"colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        const fs::path file = folder / sequence_path(d) / "georegistration.txt";
        std::vector<std::string> lines = lines_of(file), right = lines;
        const std::size_t step = d.recording.cameras.size();
        for (std::size_t i = 0; i + step < lines.size(); ++i)
          lines[i] = right[i].substr(0, right[i].find(' ')) +
                     right[i + step].substr(right[i + step].find(' '));
        write_lines(file, lines);
      },
      says({"georegistration.txt: places are shifted by 1 frame", "frame after"}, 1.0, 0.0));
}

}  // namespace terracast::test
