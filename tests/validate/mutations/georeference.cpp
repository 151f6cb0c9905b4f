#include <array>
#include <numbers>

#include "core/json.h"
#include "tests/validate/analytic_writer.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_georeference_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list), add_in_one(list, true);
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
      "HeightOffset", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_georeference(d, folder, [](std::array<double, 8>& row) { row[3] += 2.5; });
      },
      [](const RightDataset& d) {
        return Expected{{"heights are ", d.format == "kitti" ? "m too high" : "2.5 m too high"},
                        2.5,
                        d.format == "kitti" ? 0.6 : 0.01};
      });
  add(
      "PlacesInRadians", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_georeference(d, folder, [](std::array<double, 8>& row) {
          row[1] *= std::numbers::pi / 180.0;
          row[2] *= std::numbers::pi / 180.0;
        });
      },
      says({"georeference.csv: latitude and longitude are in radians"}));
  for (const bool is_ecef : {true, false})
    add_in_one(
        is_ecef ? "PlacesInEcef" : "PlacesInEnu", kAll,
        [is_ecef](const RightDataset& d, const fs::path& folder) {
          edit_georeference(d, folder, [&](std::array<double, 8>& row) {
            const ScenePlace place{row[1], row[2], row[3]};
            const Vector3d at = is_ecef ? ecef_of(place) : scene_from_place(place);
            for (std::size_t k = 0; k < 3; ++k) row[1 + k] = at[static_cast<int>(k)];
          });
        },
        says({is_ecef ? "georeference.csv: places are Earth-centred x, y, z (ECEF)"
                      : "georeference.csv: places are metres east, north, up"}));
  const auto edit_rotations = [](const std::function<Matrix3d(const Matrix3d&)>& change) {
    return [change](const RightDataset& d, const fs::path& folder) {
      edit_georeference(d, folder, [&](std::array<double, 8>& row) {
        const Quaterniond q(
            Matrix3d(change(Quaterniond(row[4], row[5], row[6], row[7]).toRotationMatrix())));
        row = {row[0], row[1], row[2], row[3], q.w(), q.x(), q.y(), q.z()};
      });
    };
  };
  add("RotationsOfPlacesInverted", kAll,
      edit_rotations([](const Matrix3d& r) -> Matrix3d { return r.transpose(); }),
      says({"georeference.csv: rotations are inverted"}));
  add("RotationsOfPlacesIntoNed", kAll, edit_rotations([](const Matrix3d& r) -> Matrix3d {
        Matrix3d swap;
        swap << 0, 1, 0, 1, 0, 0, 0, 0, -1;
        return swap * r;
      }),
      says({"georeference.csv: rotations lead into north, east, down"}));
  for (const bool is_later : {true, false})
    add(
        is_later ? "PlacesShifted" : "PlacesShiftedBack", kAll,
        [=](const RightDataset& d, const fs::path& folder) {
          write_georeference(d, folder, [&](std::size_t c, std::size_t f) {
            return true_pose(d, c, is_later ? f + 1 : f == 0 ? 0 : f - 1);
          });
        },
        [=](const RightDataset& d) {
          // On a straight flight a frame later is a constant offset.
          const bool is_offset = d.path == Path::Straight && is_later;
          return Expected{{"georeference.csv", is_offset  ? "places are off by "
                                               : is_later ? "shifted by 1 frame: each is that of "
                                                            "the frame after"
                                                          : "shifted by 1 frame: each is that of "
                                                            "the frame before"},
                          is_offset  ? 4.0
                          : is_later ? 1.0
                                     : -1.0,
                          is_offset ? 0.6 : 0.0};
        });

  // The origin alone.
  const auto edit_origin =
      [](const std::function<void(double& lat_deg, double& lon_deg, double& height_m)>& change) {
        return [change](const RightDataset&, const fs::path& folder) {
          edit_stated(folder, [&](core::Json& sequence) {
            const core::Json& origin = sequence.at("origin");
            double lat_deg = origin.at("lat_deg").number(), lon_deg = origin.at("lon_deg").number(),
                   height_m = origin.at("height_m").number();
            change(lat_deg, lon_deg, height_m);
            sequence.set("origin", core::Json::object()
                                       .set("lat_deg", lat_deg)
                                       .set("lon_deg", lon_deg)
                                       .set("height_m", height_m));
          });
        };
      };
  add("OriginLatitudeForLongitude", kAll,
      edit_origin([](double& lat_deg, double& lon_deg, double&) { std::swap(lat_deg, lon_deg); }),
      says({"origin in dataset.json: latitude and longitude are swapped"}));
  add("OriginInRadians", kAll, edit_origin([](double& lat_deg, double& lon_deg, double&) {
        lat_deg *= std::numbers::pi / 180.0;
        lon_deg *= std::numbers::pi / 180.0;
      }),
      says({"origin in dataset.json: latitude and longitude are in radians"}));
  // What is off by little may as well be the rows; packets know.
  add("OriginGeoidLeftOut", kAll,
      edit_origin([](double&, double&, double& height_m) { height_m -= kUndulation_m; }),
      [](const RightDataset& d) {
        const bool is_known = d.format == "kitti_raw";
        return is_known ? Expected{{"origin in dataset.json: heights are above the geoid"},
                                   -kUndulation_m,
                                   0.6}
                        : Expected{{"georeference.csv against the origin in dataset.json: heights",
                                    "m too high: the geoid's height added twice, or left out of "
                                    "the origin?"},
                                   kUndulation_m,
                                   0.6};
      });
  add("OriginArcSecond", kAll,
      edit_origin([](double&, double& lon_deg, double&) { lon_deg += 1.0 / 3600.0; }),
      [](const RightDataset& d) {
        return Expected{{d.format == "kitti_raw" ? "origin in dataset.json: places are off by about"
                                                 : "georeference.csv against the origin in "
                                                   "dataset.json: places are off by",
                         "arc-seconds of longitude"},
                        22.8,
                        0.6};
      });

  add(
      "PacketsLatitudeForLongitude", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) { std::swap(n[0], n[1]); });
      },
      says({"OXTS packets: latitude and longitude are swapped"}));
  add(
      "PacketsInRadians", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) {
          n[0] *= std::numbers::pi / 180.0;
          n[1] *= std::numbers::pi / 180.0;
        });
      },
      says({"OXTS packets: latitude and longitude are in radians"}));
  add(
      "PacketsArcSecond", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) { n[0] += 1.0 / 3600.0; });
      },
      says({"OXTS packets: places are off by 1.00 arc-seconds of latitude"}, 30.86, 0.05));
  add(
      "YawFromNorth", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder,
                     [](std::vector<double>& n) { n[5] = 0.5 * std::numbers::pi - n[5]; });
      },
      says({"yaw counts from north, clockwise"}));
  add(
      "RollForPitch", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) { std::swap(n[3], n[4]); });
      },
      says({"roll and pitch are swapped"}));
  add(
      "VelocitiesInKmh", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) {
          for (std::size_t i = 6; i < 11; ++i) n[i] *= 3.6;
        });
      },
      says({"velocities are in km/h"}));
  add(
      "ForcesInG", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) {
          for (std::size_t i = 11; i < 17; ++i) n[i] /= 9.80665;
        });
      },
      says({"forces are in g where m/s^2 is meant"}));
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
  // Taken off the upward value of one set of axes, or of both, as if these were level.
  struct Axes {
    const char* name;
    const char* words;
    bool is_of_body, is_of_level;
  };
  for (const Axes& axes :
       {Axes{"GravityLeftOutOfBodyAxes", "forces in the body's axes lack gravity", true, false},
        Axes{"GravityLeftOutOfLevelAxes", "forces in level axes lack gravity", false, true},
        Axes{"GravityLeftOutOfBothUps", "forces lack gravity", true, true}})
    add_in_one(
        axes.name, {"kitti_raw"},
        [axes](const RightDataset& d, const fs::path& folder) {
          edit_packets(d, folder, [&](std::vector<double>& n) {
            if (axes.is_of_body) n[13] -= 9.81;
            if (axes.is_of_level) n[16] -= 9.81;
          });
        },
        says({axes.words}));
  add_in_one(
      "GravityDownwards", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        Mistake mistake;
        mistake.oxts.gravity = -1.0;
        write_kitti_raw(d.recording, folder, mistake);
      },
      says({"forces have gravity downwards"}));
}

void add_place_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list, true);
  add(
      "OnePlaceOff", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        constexpr int kRow = 4;  // KITTI's first row places all others
        int index = 0;
        edit_georeference(d, folder, [&](std::array<double, 8>& row) {
          if (index++ == kRow) row[1] += 2.0 / 111132.0;
        });
      },
      says({"georeference.csv: the place of", "is off by"}, 2.0, 0.02));
  add(
      "OneTimeOff", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        constexpr int kRow = 3;
        int index = 0;
        edit_georeference(d, folder, [&](std::array<double, 8>& row) {
          if (index++ == kRow) row[0] += 0.003;
        });
      },
      says({"georeference.csv: the time of", "is off by"}, 0.003, 1e-6));
}

}  // namespace terracast::test
