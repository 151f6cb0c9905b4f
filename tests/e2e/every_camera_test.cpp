// terracast's own format with every camera model there is: from configs/every_camera.toml to reports in which every
// bound holds; and datasets that are wrong, each found by the check that is for it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/npz_reader.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

fs::path every_camera() { return fs::path(TERRACAST_SOURCE_DIR) / "configs/every_camera.toml"; }

TEST(EveryCameraFlight, TheConfigHasEveryModelThatTheProgramKnows) {
  const ProgramResult list = run_program({"list", "cameras"});
  ASSERT_EQ(list.status, 0);
  std::set<std::string> known;
  std::istringstream lines(list.output);
  for (std::string line; std::getline(lines, line);) known.insert(line.substr(0, line.find(' ')));
  const std::string config = core::read_text_file(every_camera());
  std::set<std::string> used;
  std::istringstream words(config);
  bool is_camera = false, has_model = false;
  for (std::string line; std::getline(words, line);) {
    if (line.starts_with("[")) {
      if (is_camera && !has_model) used.insert("pinhole");
      is_camera = line == "[[rigs.cameras]]";
      has_model = false;
    }
    if (!line.starts_with("model = \"")) continue;
    has_model = true;
    used.insert(line.substr(9, line.size() - 10));
  }
  EXPECT_GE(known.size(), 16U);
  EXPECT_EQ(used, known);
}

Json check_of(const fs::path& report, const std::string& name) {
  const Json json = Json::read(report / "report.json");
  for (std::size_t i = 0; i < json.at("checks").size(); ++i) {
    const Json& check = json.at("checks").at(i);
    if (check.at("name").string() == name) return check;
  }
  return {};
}

/// Tracks step from the first frame to the second as the datasets' flow has it at the pixels in which they were drawn.
/// They are made of rays in double, flow of ranges that are kept as floats.
void expect_tracks_follow_flow(const fs::path& out) {
  const fs::path labels = out / "capture/P000/labels/tracks";
  const auto points = read_npz(labels / "points.npz");
  const std::vector<std::string> cameras =
      Json::read(labels / "tracks.json").at("cameras").strings();
  EXPECT_GE(cameras.size(), 16U);
  for (std::size_t camera = 0; camera < cameras.size(); ++camera) {
    SCOPED_TRACE(cameras[camera]);
    const auto tracks = read_npz(labels / (cameras[camera] + ".npz"));
    const fs::path dataset = out / "export/terracast/P000" / cameras[camera];
    const Array flow = parse_npy(core::read_text_file(dataset / "flow_forward/000000.npy"));
    int num_compared = 0, num_moving = 0;
    for (int n = 0; n < points.at("body").shape[0]; ++n) {
      if (points.at("query_frame").at({n}) != 0.0 ||
          points.at("query_camera").at({n}) != static_cast<double>(camera))
        continue;
      const auto query = [&](int axis) { return points.at("query_px").at({n, axis}); };
      const auto step = [&](int axis) {
        return tracks.at("tracks_px").at({n, 1, axis}) - query(axis);
      };
      const auto exported = [&](int axis) {
        return flow.at({static_cast<int>(query(1)), static_cast<int>(query(0)), axis});
      };
      EXPECT_EQ(std::isnan(step(0)), std::isnan(exported(0)));
      if (tracks.at("in_image").at({n, 1}) == 0.0) continue;
      // Steps of up to 320 px around a sphere are floats; at its poles floats of ranges count, too.
      for (const int axis : {0, 1}) EXPECT_NEAR(step(axis), exported(axis), 1e-4);
      ++num_compared;
      num_moving += points.at("body").at({n}) >= 0.0 ? 1 : 0;
    }
    EXPECT_GT(num_compared, 20);
    EXPECT_GT(num_moving, 2);
  }
}

TEST(EveryCameraFlight, EveryCheckHolds) {
  const ScratchFolder scratch;
  const fs::path out = scratch / "out";
  const std::vector<std::string> job = {every_camera().string(),
                                        "--out",
                                        out.string(),
                                        "-q",
                                        "--set",
                                        "trajectories.0.num_frames=2",
                                        "--set",
                                        "detail.finest_spacing_m=4",
                                        "--set",
                                        "conditions.color_samples=2",
                                        "--set",
                                        "validate.oracle_samples=40",
                                        "--set",
                                        "validate.samples_per_image=1000",
                                        "--set",
                                        "exports.1.depth=false"};
  const auto run_job = [&](const std::string& command, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {command};
    arguments.insert(arguments.end(), job.begin(), job.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  };
  const ProgramResult run = run_job("run", {});
  ASSERT_EQ(run.status, 0) << run.output;
  const fs::path report = out / "report/terracast";
  EXPECT_TRUE(Json::read(report / "report.json").at("ok").boolean());
  for (const char* name : {"structure",
                           "rays",
                           "calibration_intrinsics",
                           "georeference_position",
                           "bounds_depth",
                           "bounds_flow",
                           "reprojection",
                           "reprojection_see_through",
                           "reprojection_rotation",
                           "flow",
                           "flow_masks",
                           "photometric_correlation",
                           "segmentation",
                           "moving_depth",
                           "moving_flow",
                           "oracle_depth",
                           "oracle_class",
                           "oracle_occlusion",
                           "oracle_normal",
                           "oracle_instance"}) {
    SCOPED_TRACE(name);
    const Json check = check_of(report, name);
    ASSERT_FALSE(check.is_null());
    EXPECT_TRUE(check.at("ok").boolean());
    EXPECT_FALSE(check.at("skipped").boolean());
  }
  const ProgramResult label = run_job("label", {"--what", "tracks"});
  ASSERT_EQ(label.status, 0) << label.output;
  expect_tracks_follow_flow(out);
}

/// A small right dataset, and copies of it that are wrong.
class WrongDatasets : public testing::Test {
 protected:
  static constexpr int kWidth = 160, kHeight = 120;
  static constexpr double kFocal_px = 110.0;

  void SetUp() override {
    if (scratch) return;
    scratch = std::make_unique<ScratchFolder>();
    std::string text = tiny_job_text();
    text = text.substr(0, text.find("[[rigs]]")) + R"([[rigs]]
name = "rig"
mount_pitch_deg = 40.0

[[rigs.cameras]]
name = "pinhole"
width_px = 160
height_px = 120
fx_px = 110.0

[[rigs.cameras]]
name = "fish"
model = "opencv_fisheye"
width_px = 160
height_px = 120
fx_px = 60.0
k1 = 0.02
offset_mm = [0.0, -500.0, 0.0]
line_time_us = 3000.0

[[rigs.cameras]]
name = "sphere"
model = "double_sphere"
width_px = 160
height_px = 120
fx_px = 40.0
xi = -0.2
alpha = 0.6
offset_mm = [0.0, 500.0, 0.0]
line_time_us = 1000.0

[[rigs.cameras]]
name = "scanner"
model = "pushbroom"
width_px = 160
height_px = 120
fx_px = 110.0
fy_px = 2.0
offset_mm = [500.0, 0.0, 0.0]

[[rigs.cameras]]
name = "round"
model = "equirectangular"
width_px = 160
height_px = 80
offset_mm = [-500.0, 0.0, 0.0]

[[trajectories]]
name = "P000"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 120.0, above = "ground"}
radius_m = 200.0
speed_mps = 30.0
rate_hz = 2.0
num_frames = 3

[conditions]
color_samples = 2

[tracks]
num_points = 2000

[[exports]]
format = "terracast"
)";
    const fs::path job = write_text(*scratch / "job.toml", text);
    run = run_program({"run", job.string(), "--out", (*scratch / "out").string(), "-q", "--set",
                       "validate.oracle_samples=50"});
  }
  static void TearDownTestSuite() { scratch.reset(); }

  static fs::path right() { return *scratch / "out/export/terracast"; }

  /// Copies the right dataset, changes the copy, lists its files as they are then, and validates it.
  /// returns   the checks that fail, and where they are worst
  template <class Change>
  static std::map<std::string, std::string> failed(const Change& change, bool has_oracle = false) {
    const fs::path wrong = *scratch / "wrong", report = *scratch / "report";
    fs::remove_all(wrong);
    fs::remove_all(report);
    fs::copy(right(), wrong, fs::copy_options::recursive);
    change(wrong);
    list_again(wrong);
    std::vector<std::string> arguments = {"validate", wrong.string(), "--report", report.string()};
    if (has_oracle)
      arguments.insert(arguments.end(),
                       {"--world", (*scratch / "out/world").string(), "--oracle-samples", "50"});
    const ProgramResult result = run_program(arguments);
    EXPECT_EQ(result.status, 1) << result.output;
    std::map<std::string, std::string> checks;
    const Json json = Json::read(report / "report.json");
    for (std::size_t i = 0; i < json.at("checks").size(); ++i) {
      const Json& check = json.at("checks").at(i);
      if (!check.at("ok").boolean()) checks[check.at("name").string()] = check.at("worst").string();
    }
    return checks;
  }

  static void list_again(const fs::path& folder) {
    Json dataset = Json::read(folder / "dataset.json");
    Json files = Json::object();
    for (const auto& [path, record] : dataset.at("files").members())
      files.set(path, Json::object()
                          .set("bytes", static_cast<std::int64_t>(fs::file_size(folder / path)))
                          .set("xxh3_128", core::content_hash_of_file(folder / path)));
    dataset.set("files", std::move(files));
    dataset.write(folder / "dataset.json");
  }

  /// The values of an npy behind its header.
  template <class Value, class Change>
  static void edit_npy(const fs::path& file, const Change& change) {
    std::string bytes = core::read_text_file(file);
    const std::size_t start =
        10 + (static_cast<unsigned char>(bytes.at(8)) |
              static_cast<std::size_t>(static_cast<unsigned char>(bytes.at(9))) << 8);
    std::vector<Value> values((bytes.size() - start) / sizeof(Value));
    std::memcpy(values.data(), bytes.data() + start, values.size() * sizeof(Value));
    change(values);
    std::memcpy(bytes.data() + start, values.data(), values.size() * sizeof(Value));
    core::write_file(file, std::string_view(bytes));
  }

  /// The entries of a camera in cameras.json and in dataset.json.
  template <class Edit>
  static void edit_camera(const fs::path& folder, std::size_t camera, const Edit& edit) {
    Json cameras = Json::read(folder / "P000/cameras.json");
    cameras.set("cameras", edited_list(cameras.at("cameras"), camera, edit));
    cameras.write(folder / "P000/cameras.json");
    edit_dataset(folder, camera, edit);
  }
  /// A number of the parameters of a camera, in both.
  static void edit_parameter(const fs::path& folder, std::size_t camera, std::size_t number,
                             double change) {
    const auto edited = [&](Json entry) {
      std::vector<double> p =
          entry.has("parameters") ? entry.at("parameters").numbers() : std::vector<double>{};
      const char* names[] = {"fx_px", "fy_px", "cx_px", "cy_px"};
      if (!p.empty()) {
        p[number] += change;
        entry.set("parameters", Json::array_of(p));
      }
      if (number < 4 && entry.has(names[number]))
        entry.set(names[number], entry.at(names[number]).number() + change);
      return entry;
    };
    edit_camera(folder, camera, edited);
  }
  static void set_parameters(const fs::path& folder, std::size_t camera,
                             const std::vector<double>& parameters) {
    edit_camera(folder, camera, [&](Json entry) {
      const char* names[] = {"fx_px", "fy_px", "cx_px", "cy_px"};
      if (entry.has("parameters")) entry.set("parameters", Json::array_of(parameters));
      for (std::size_t i = 0; i < 4; ++i)
        if (entry.has(names[i])) entry.set(names[i], parameters[i]);
      return entry;
    });
  }
  template <class Edit>
  static Json edited_list(const Json& list, std::size_t index, const Edit& edit) {
    Json all = Json::array();
    for (std::size_t i = 0; i < list.size(); ++i)
      all.push(i == index ? edit(list.at(i)) : list.at(i));
    return all;
  }
  template <class Edit>
  static void edit_dataset(const fs::path& folder, std::size_t camera, const Edit& edit) {
    Json dataset = Json::read(folder / "dataset.json");
    Json sequence = dataset.at("sequences").at(0);
    sequence.set("cameras", edited_list(sequence.at("cameras"), camera, edit));
    dataset.set("sequences", Json::array().push(sequence));
    dataset.write(folder / "dataset.json");
  }

  /// The rays of the pinhole with its principal point moved, and its centres at another part of the pixel.
  static void write_pinhole_rays(const fs::path& folder, double cx_px, double center) {
    edit_npy<double>(folder / "P000/rig/pinhole/rays.npy", [&](std::vector<double>& values) {
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const Eigen::Vector3d ray = Eigen::Vector3d((x + center - cx_px) / kFocal_px,
                                                      (y + center - 0.5 * kHeight) / kFocal_px, 1.0)
                                          .normalized();
          for (int k = 0; k < 3; ++k)
            values[static_cast<std::size_t>(3 * (y * kWidth + x) + k)] = ray[k];
        }
    });
  }

  /// Changes the rows of a camera in a table.
  /// change   of a row's cells, and of all rows of the camera
  template <class Change>
  static void edit_rows(const fs::path& file, const std::string& camera, const Change& change) {
    std::istringstream text(core::read_text_file(file));
    std::string line, result;
    std::vector<std::vector<std::string>> rows;
    std::vector<std::size_t> of_camera;
    while (std::getline(text, line)) {
      std::vector<std::string> cells;
      std::istringstream parts(line);
      for (std::string cell; std::getline(parts, cell, ',');) cells.push_back(cell);
      if (cells[1] == camera) of_camera.push_back(rows.size());
      rows.push_back(std::move(cells));
    }
    const std::vector<std::vector<std::string>> before = rows;
    for (std::size_t k = 0; k < of_camera.size(); ++k) {
      const std::size_t next = of_camera[std::min(k + 1, of_camera.size() - 1)];
      change(rows[of_camera[k]], before[next]);
    }
    for (const auto& row : rows) result += fmt::format("{}\n", fmt::join(row, ","));
    core::write_file(file, std::string_view(result));
  }
  /// Turns a camera about its own axis, in all that says how it stands.
  static void turn_camera(const fs::path& folder, std::size_t index, const std::string& camera,
                          const Eigen::Quaterniond& turn) {
    for (const char* file : {"poses.csv", "georeference.csv"})
      edit_rows(folder / "P000" / file, camera, [&](auto& row, const auto&) {
        const Eigen::Quaterniond q = Eigen::Quaterniond(std::stod(row[6]), std::stod(row[7]),
                                                        std::stod(row[8]), std::stod(row[9])) *
                                     turn;
        const double n[4] = {q.w(), q.x(), q.y(), q.z()};
        for (std::size_t k = 0; k < 4; ++k) row[6 + k] = fmt::format("{:.17g}", n[k]);
      });
    const auto edited = [&](Json entry) {
      Json mount = entry.at("body_from_camera");
      const std::vector<double> w = mount.at("rotation_wxyz").numbers();
      const Eigen::Quaterniond q = Eigen::Quaterniond(w[0], w[1], w[2], w[3]) * turn;
      mount.set("rotation_wxyz", Json::array_of({q.w(), q.x(), q.y(), q.z()}));
      entry.set("body_from_camera", std::move(mount));
      return entry;
    };
    edit_camera(folder, index, edited);
  }

  static inline std::unique_ptr<ScratchFolder> scratch;
  static inline ProgramResult run;
};

fs::path file_of(const fs::path& folder, const std::string& camera, const std::string& path) {
  return folder / "P000/rig" / camera / path;
}

TEST_F(WrongDatasets, OfMetadataAreFound) {
  ASSERT_EQ(run.status, 0) << run.output;
  // A principal point by a tenth of a pixel, in all that says so: depth and flow tell. Where the rays of a scanner start,
  // by a centimetre.
  EXPECT_THAT(failed([](const fs::path& folder) {
                edit_parameter(folder, 0, 2, 0.1);
                write_pinhole_rays(folder, 0.5 * kWidth + 0.1, 0.5);
                edit_npy<double>(file_of(folder, "scanner", "origins.npy"), [](auto& values) {
                  for (std::size_t i = 1; i < values.size(); i += 3) values[i] += 0.01;
                });
              }),
              testing::AllOf(Contains(Pair("flow_principal_point", HasSubstr("rig/pinhole"))),
                             Contains(Pair("rays", HasSubstr("rig/scanner")))));
  // One ray of a table, by a thousandth of a pixel: nothing else tells.
  EXPECT_THAT(failed([](const fs::path& folder) {
                edit_npy<double>(file_of(folder, "sphere", "rays.npy"), [](auto& values) {
                  const std::size_t at = 3 * (60 * kWidth + 70);
                  Eigen::Vector3d ray(values[at], values[at + 1], values[at + 2]);
                  ray = (ray + Eigen::Vector3d(1e-5, 0.0, 0.0)).normalized();
                  for (std::size_t k = 0; k < 3; ++k) values[at + k] = ray[static_cast<int>(k)];
                });
              }),
              ElementsAre(Pair("rays", HasSubstr("rig/sphere, pixel (70, 60)"))));
  // A lens's own parameter.
  EXPECT_THAT(failed([](const fs::path& folder) { edit_parameter(folder, 1, 4, 1e-3); }),
              testing::AllOf(Contains(Pair("rays", HasSubstr("rig/fish"))),
                             Contains(Pair("flow", HasSubstr("rig/fish")))));
  // A model's; and lines that follow each other slower by two percent.
  EXPECT_THAT(failed([](const fs::path& folder) {
                edit_parameter(folder, 2, 5, 1e-4);
                edit_camera(folder, 1, [](Json entry) {
                  Json shutter = entry.at("shutter");
                  shutter.set("line_time_s", 1.02 * shutter.at("line_time_s").number());
                  entry.set("shutter", std::move(shutter));
                  return entry;
                });
              }),
              testing::AllOf(Contains(Pair("rays", HasSubstr("rig/sphere"))),
                             Contains(Pair("flow_line_time", testing::_))));
  // A camera turned by a hundredth of a degree, in all that says so; a range where no ray comes in.
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.01 * M_PI / 180.0, Eigen::Vector3d::UnitX()));
  EXPECT_THAT(failed([&](const fs::path& folder) {
                turn_camera(folder, 0, "rig/pinhole", turn);
                edit_npy<float>(file_of(folder, "sphere", "range/000002.npy"),
                                [](auto& values) { values[0] = 1e5F; });
              }),
              testing::AllOf(Contains(Pair("flow_rotation", HasSubstr("rig/pinhole"))),
                             Contains(Pair("structure", HasSubstr("no ray comes in")))));
}

TEST_F(WrongDatasets, OfFramesAndImagesAreFound) {
  ASSERT_EQ(run.status, 0) << run.output;
  const std::vector<std::string> frames = {"000000", "000001", "000002"};
  // The next frame's poses; masks of the other direction.
  EXPECT_THAT(failed([](const fs::path& folder) {
                edit_rows(folder / "P000/poses.csv", "rig/sphere", [](auto& row, const auto& next) {
                  for (std::size_t k = 3; k < 10; ++k) row[k] = next[k];
                });
                fs::copy_file(file_of(folder, "fish", "flow_backward/000001_mask.png"),
                              file_of(folder, "fish", "flow_forward/000001_mask.png"),
                              fs::copy_options::overwrite_existing);
              }),
              testing::AllOf(Contains(Pair("georeference_position", HasSubstr("rig/sphere"))),
                             Contains(Pair("flow", HasSubstr("rig/sphere"))),
                             Contains(Pair("flow_masks", testing::_))));
  // Ranges longer by a thousandth, in all frames; a table of rays through pixels' corners.
  EXPECT_THAT(failed([&](const fs::path& folder) {
                for (const std::string& frame : frames)
                  edit_npy<float>(file_of(folder, "fish", "range/" + frame + ".npy"),
                                  [](auto& values) {
                                    for (float& value : values) value *= 1.001F;
                                  });
                write_pinhole_rays(folder, 0.5 * kWidth, 0.0);
              }),
              testing::AllOf(Contains(Pair("reprojection_scale", testing::_)),
                             Contains(Pair("flow", HasSubstr("rig/fish"))),
                             Contains(Pair("rays", HasSubstr("rig/pinhole")))));
  // Depth where range is meant; another frame's image.
  EXPECT_THAT(failed([&](const fs::path& folder) {
                for (const std::string& frame : frames)
                  edit_npy<float>(file_of(folder, "pinhole", "range/" + frame + ".npy"),
                                  [](auto& values) {
                                    for (int i = 0; i < kWidth * kHeight; ++i) {
                                      const double a = (i % kWidth + 0.5 - 80.0) / kFocal_px;
                                      const double b = (i / kWidth + 0.5 - 60.0) / kFocal_px;
                                      values[static_cast<std::size_t>(i)] /=
                                          static_cast<float>(std::sqrt(1.0 + a * a + b * b));
                                    }
                                  });
                fs::copy_file(file_of(folder, "sphere", "image/000002.png"),
                              file_of(folder, "sphere", "image/000001.png"),
                              fs::copy_options::overwrite_existing);
              }),
              testing::AllOf(Contains(Pair("reprojection", HasSubstr("rig/pinhole"))),
                             Contains(Pair("flow", HasSubstr("rig/pinhole"))),
                             Contains(Pair("photometric_frames", HasSubstr("rig/sphere")))));
  // Flow of the other sign; normals in other axes, and instances of nothing.
  EXPECT_THAT(failed(
                  [&](const fs::path& folder) {
                    edit_npy<float>(file_of(folder, "sphere", "flow_forward/000001.npy"),
                                    [](auto& values) {
                                      for (float& value : values) value = -value;
                                    });
                    edit_npy<float>(file_of(folder, "fish", "normal/000001.npy"), [](auto& values) {
                      for (std::size_t i = 0; i < values.size(); i += 3)
                        std::swap(values[i], values[i + 1]);
                    });
                    edit_npy<std::uint32_t>(file_of(folder, "fish", "instance/000001.npy"),
                                            [](auto& values) {
                                              for (auto& value : values) value += 1;
                                            });
                  },
                  true),
              testing::AllOf(Contains(Pair("flow", HasSubstr("rig/sphere"))),
                             Contains(Pair("oracle_normal", HasSubstr("rig/fish"))),
                             Contains(Pair("oracle_instance", HasSubstr("rig/fish")))));
}

/// The mask of a flow.
core::Image8 mask_of(const fs::path& folder, const std::string& camera, const std::string& stem) {
  const fs::path file = file_of(folder, camera, stem + "_mask.png");
  return std::get<core::Image8>(core::decode_png(core::read_file(file), file.string()));
}

TEST_F(WrongDatasets, OfFlowAreFound) {
  ASSERT_EQ(run.status, 0) << run.output;
  // Once around the panorama too far: the same place on the sphere, but none of the image. Half of a flow.
  EXPECT_THAT(failed([](const fs::path& folder) {
                edit_npy<float>(file_of(folder, "round", "flow_forward/000001.npy"),
                                [](auto& values) {
                                  for (std::size_t i = 0; i < values.size(); i += 2)
                                    values[i] += 160.0F;
                                });
                edit_npy<float>(file_of(folder, "fish", "flow_backward/000001.npy"),
                                [](auto& values) { values[9001] = NAN; });
              }),
              ElementsAre(Pair("flow_masks", HasSubstr("seam")),
                          Pair("structure", HasSubstr("two finite numbers or two NaN"))));
  // Flow that ends beside the image is left out, though the camera sees the points.
  EXPECT_THAT(failed([](const fs::path& folder) {
                const core::Image8 mask = mask_of(folder, "pinhole", "flow_forward/000001");
                edit_npy<float>(file_of(folder, "pinhole", "flow_forward/000001.npy"),
                                [&](auto& values) {
                                  for (std::size_t i = 0; i < values.size(); ++i)
                                    if (mask.data()[i / 2] == 0) values[i] = NAN;
                                });
              }),
              ElementsAre(Pair("flow_masks", HasSubstr("seen by the other camera"))));
  // Flow of a rolling camera where no ray comes in.
  EXPECT_THAT(failed([](const fs::path& folder) {
                edit_npy<float>(file_of(folder, "sphere", "flow_backward/000001.npy"),
                                [](auto& values) {
                                  for (std::size_t i = 0; i < 24; ++i)
                                    values[i] = values[2 * kWidth - 24 + i] = 1.0F;
                                });
              }),
              ElementsAre(Pair("flow_masks", HasSubstr("no ray comes in"))));
}

// Parameters beyond all sense end in a report, with the oracle too.
TEST_F(WrongDatasets, OfHostileParametersAreReported) {
  ASSERT_EQ(run.status, 0) << run.output;
  const auto checks = failed(
      [](const fs::path& folder) {
        set_parameters(folder, 3, {1e-200, 1e-25, 80.0, 60.0});
        set_parameters(folder, 4, {1e-200, 1e-200, 1e300, 40.0});
      },
      true);
  EXPECT_THAT(checks, Contains(Pair("rays", testing::_)));
}

}  // namespace
}  // namespace terracast::test
