#include <array>
#include <numbers>

#include "tests/validate/analytic_writer.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_georeference_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list);
  add(
      "GeoidLeftOut", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        if (d.format == "kitti_raw")
          edit_packets(d, folder, [](std::vector<double>& n) { n[2] -= kUndulation_m; });
        else
          edit_georeference(d, folder, [](std::array<double, 8>& row) { row[3] -= kUndulation_m; });
      },
      [](const RightDataset& d) {
        // KITTI's rows are held against the origin, which is rounded to a metre.
        return Expected{
            {"heights are above the geoid", d.format == "kitti" ? "m too low" : "52.8 m too low"},
            -kUndulation_m,
            d.format == "kitti" ? 0.6 : 0.01};
      });
  add(
      "HeightsTooHigh", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        if (d.format == "kitti_raw")
          edit_packets(d, folder, [](std::vector<double>& n) { n[2] += 48.2; });
        else
          edit_georeference(d, folder, [](std::array<double, 8>& row) { row[3] += 48.2; });
      },
      [](const RightDataset& d) {
        return Expected{{"m too high: above another datum?",
                         d.format == "kitti" ? "heights are about 4" : "heights are 48.2 m"},
                        48.2,
                        d.format == "kitti" ? 0.6 : 0.01};
      });
  add(
      "ArcSecond", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_georeference(d, folder, [](std::array<double, 8>& row) { row[1] += 1.0 / 3600.0; });
      },
      [](const RightDataset& d) {
        return Expected{
            {d.format == "kitti" ? "arc-seconds of latitude" : "1.00 arc-seconds of latitude"},
            30.86,
            d.format == "kitti" ? 0.6 : 0.05};
      });
  add(
      "LatitudeForLongitude", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_georeference(d, folder, [](std::array<double, 8>& row) { std::swap(row[1], row[2]); });
      },
      says({"latitude and longitude are swapped"}));

  add(
      "AnglesInDegrees", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) {
          for (std::size_t i = 3; i < 6; ++i) n[i] *= 180.0 / std::numbers::pi;
        });
      },
      says({"angles are in degrees"}));
  add(
      "AnglesOfTheWorldsOrigin", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        Mistake mistake;
        mistake.oxts.axes_east_m = 25000.0;
        write_kitti_raw(d.recording, folder, mistake);
      },
      says({"angles stand in the east, north, up of a place 25.0 km east"}, 25.0, 0.1));
  add(
      "VelocitiesSwapped", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) { std::swap(n[6], n[7]); });
      },
      says({"velocities to the north and to the east are swapped"}));
  add(
      "RatesInDegrees", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) {
          for (std::size_t i = 17; i < 23; ++i) n[i] *= 180.0 / std::numbers::pi;
        });
      },
      says({"turn rates are in deg/s"}));
  add(
      "GravityLeftOut", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        Mistake mistake;
        mistake.oxts.gravity = 0.0;
        write_kitti_raw(d.recording, folder, mistake);
      },
      says({"forces lack gravity"}));
}

}  // namespace terracast::test
