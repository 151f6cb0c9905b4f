// Small datasets of terracast's own format, written here from docs/formats/terracast.md: right ones have no findings, and
// everything that a file says and should not is one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_writer.h"
#include "validate/checks/checker.h"
#include "validate/dataset.h"
#include "validate/frames.h"

namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using core::Json;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kWidth = 40, kHeight = 30;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A camera as dataset.json and cameras.json have it.
struct Entry {
  std::string name = "fish";
  std::string model = "opencv_fisheye";
  double focal_px = 12.0;
  std::vector<double> own = {-0.1, 0.0, 0.0, 0.0};
  std::string names = "fx, fy, cx, cy, k1, k2, k3, k4";
  bool is_central = true;

  std::vector<double> parameters() const {
    std::vector<double> p = {focal_px, focal_px, 0.5 * kWidth, 0.5 * kHeight};
    p.insert(p.end(), own.begin(), own.end());
    return p;
  }
  Json mount() const {
    return Json::object()
        .set("rotation_wxyz", Json::array_of({0.5, -0.5, 0.5, -0.5}))
        .set("translation_m", Json::array_of({1.0, -0.25, 0.125}));
  }
  Json shutter() const {
    return Json::object().set("exposure_s", 0.001).set("line_time_s", 1e-5).set("readout", "up");
  }
  Json stated() const {
    return Json::object()
        .set("name", "rig/" + name)
        .set("width_px", kWidth)
        .set("height_px", kHeight)
        .set("fx_px", focal_px)
        .set("fy_px", focal_px)
        .set("cx_px", 0.5 * kWidth)
        .set("cy_px", 0.5 * kHeight)
        .set("model", model)
        .set("parameters", Json::array_of(parameters()))
        .set("body_from_camera", mount())
        .set("shutter", shutter());
  }
  Json own_file() const {
    Json json = Json::object()
                    .set("name", "rig/" + name)
                    .set("rig", "rig")
                    .set("camera", name)
                    .set("width_px", kWidth)
                    .set("height_px", kHeight)
                    .set("model", model)
                    .set("parameter_names", names)
                    .set("parameters", Json::array_of(parameters()))
                    .set("body_from_camera", mount())
                    .set("shutter", shutter())
                    .set("rays", "rig/" + name + "/rays.npy");
    if (!is_central) json.set("origins", "rig/" + name + "/origins.npy");
    return json;
  }

  /// Of the fisheye: its image ends where t - t³ / 10 has its maximum, at t² = 10/3.
  bool has_ray(int x, int y) const {
    const double end = 2.0 / 3.0 * std::sqrt(10.0 / 3.0);
    return !is_central ||
           std::hypot(x + 0.5 - 0.5 * kWidth, y + 0.5 - 0.5 * kHeight) < end * focal_px;
  }
  Vector3d ray(int x, int y) const {
    if (!is_central) return Vector3d::UnitZ();
    if (!has_ray(x, y)) return Vector3d::Constant(kNone);
    const Vector2d place = Vector2d(x + 0.5 - 0.5 * kWidth, y + 0.5 - 0.5 * kHeight) / focal_px;
    double low = 0.0, high = std::sqrt(10.0 / 3.0);
    for (int i = 0; i < 200; ++i) {
      const double t = 0.5 * (low + high);
      (t - 0.1 * t * t * t < place.norm() ? low : high) = t;
    }
    const Vector2d aside = place.normalized() * std::sin(low);
    return Vector3d(aside.x(), aside.y(), std::cos(low)).normalized();
  }
};
const Entry kParallel = {"scan", "orthographic", 4.0, {}, "fx, fy, cx, cy", false};

template <class Value, class ValueOf>
void write_array(const fs::path& file, const char* type, std::size_t channels,
                 const ValueOf& value_of) {
  std::vector<Value> values;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (std::size_t k = 0; k < std::max<std::size_t>(channels, 1); ++k)
        values.push_back(value_of(x, y, static_cast<int>(k)));
  std::vector<std::size_t> shape = {kHeight, kWidth};
  if (channels > 0) shape.push_back(channels);
  fs::create_directories(file.parent_path());
  core::write_file(file, std::string_view(test::npy_bytes(type, shape, values.data(),
                                                          values.size() * sizeof(Value))));
}
void write_vectors(const fs::path& file, const std::function<Vector3d(int x, int y)>& vector) {
  write_array<double>(file, "<f8", 3, [&](int x, int y, int k) { return vector(x, y)[k]; });
}

/// The sequence of one camera and one frame; a belief makes the format's files say that.
struct Files {
  Json dataset, cameras, classes;
};
Files files_of(const std::string& format, const Entry& truth) {
  Json sequence =
      Json::object()
          .set("name", "P000")
          .set("path", "P000")
          .set("num_frames", 1)
          .set("rate_hz", 10.0)
          .set("utc_start", "2026-06-21T10:00:00Z")
          .set("origin",
               Json::object().set("lat_deg", 42.5).set("lon_deg", 1.5).set("height_m", 1000.0))
          .set("cameras", Json::array().push(truth.stated()))
          .set("georeference", "P000/georeference.csv")
          .set("motion", "P000/motion.csv");
  Json files = Json::object();
  for (const char* path : {"P000/cameras.json", "P000/poses.csv"})
    files.set(path, Json::object().set("bytes", 1).set("xxh3_128", "0"));
  return {.dataset = Json::object()
                         .set("format", format)
                         .set("world", Json::object().set("name", "w").set("input_hash", "0"))
                         .set("files", files)
                         .set("sequences", Json::array().push(sequence)),
          .cameras = Json::object()
                         .set("format", "terracast-cameras")
                         .set("version", 1)
                         .set("cameras", Json::array().push(truth.own_file())),
          .classes = Json::parse(R"({"classes": {"sky": 0, "grass": 5, "nothing": 31}})", "test")};
}

struct TerracastReading : testing::Test {
  test::ScratchFolder scratch;
  Findings findings;

  fs::path at(const Entry& entry, const std::string& file) const {
    return scratch / ("P000/rig/" + entry.name + "/" + file);
  }
  void write(const Entry& entry, const Files& files) const {
    fs::create_directories(scratch / "P000");
    files.dataset.write(scratch / "dataset.json");
    files.cameras.write(scratch / "P000/cameras.json");
    files.classes.write(scratch / "classes.json");
    const std::string row = "0,rig/" + entry.name + ",0,";
    const auto text = [&](const char* file, const std::string& lines) {
      core::write_file(scratch / file, std::string_view(lines));
    };
    text("P000/georeference.csv", "frame,camera,time_s,lat_deg,lon_deg,height_m,qw,qx,qy,qz\n" +
                                      row + "42.5,1.5,1000,1,0,0,0\n");
    text("P000/poses.csv",
         "frame,camera,time_s,x_m,y_m,z_m,qw,qx,qy,qz\n" + row + "0,0,0,1,0,0,0\n");
    text("P000/motion.csv",
         "frame,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,wx_radps,wy_radps,wz_radps\n"
         "0,0,0,0,0,0,0,0,0,0\n");
    write_vectors(at(entry, "rays.npy"), [&](int x, int y) { return entry.ray(x, y); });
    if (!entry.is_central)
      write_vectors(at(entry, "origins.npy"), [&](int x, int y) {
        return Vector3d((x + 0.5 - 0.5 * kWidth) / entry.focal_px,
                        (y + 0.5 - 0.5 * kHeight) / entry.focal_px, 0.0);
      });
  }
  /// Ranges of 50 m, where the camera has a ray.
  void write_ranges(const Entry& entry) const {
    write_array<float>(at(entry, "range/000000.npy"), "<f4", 0, [&](int x, int y, int) {
      return entry.has_ray(x, y) ? 50.0F : std::numeric_limits<float>::quiet_NaN();
    });
  }
  Dataset read() { return read_dataset(scratch.path(), "", findings); }
  /// What is found when one member of a camera's entry in cameras.json is another.
  std::vector<std::string> found_with(const Entry& entry, const char* member, Json value) {
    Files files = files_of("terracast", entry);
    Json camera = entry.own_file();
    camera.set(member, std::move(value));
    files.cameras.set("cameras", Json::array().push(camera));
    write(entry, files);
    Findings found;
    read_dataset(scratch.path(), "", found);
    return found.lines();
  }
  static std::map<std::string, CheckResult> rays_results(const Dataset& dataset) {
    std::map<std::string, CheckResult> results;
    for (const CheckInfo& info : checks())
      if (info.name == std::string("rays"))
        for (const CheckResult& result : info.make({})->finish(dataset, dataset.sequences.at(0)))
          results[result.name] = result;
    return results;
  }
};

TEST_F(TerracastReading, RightFilesHaveNoFindings) {
  for (const Entry& entry : {Entry{}, kParallel}) {
    write(entry, files_of("terracast", entry));
    write_ranges(entry);
    const Dataset dataset = read();
    EXPECT_THAT(findings.lines(), IsEmpty());
    const Camera& camera = dataset.sequences.at(0).cameras.at(0);
    EXPECT_EQ(find_reader("terracast").depth(dataset, camera, 0)(20, 15), 50.0F);
    for (const auto& [name, result] : rays_results(dataset)) EXPECT_TRUE(result.ok) << name;
    fs::remove_all(scratch / "P000");
  }
}

TEST_F(TerracastReading, EveryMemberOfACameraIsHeldAgainstTheDataset) {
  const Entry entry;
  const auto finds = [](const char* word) {
    return ElementsAre(AllOf(HasSubstr("cameras.json: rig/fish"), HasSubstr(word)));
  };
  // By half an arc second, and by a hundredth of a millimetre.
  Json turned = entry.mount(), moved = entry.mount();
  const double angle = 0.5 / 3600.0 * M_PI / 180.0;
  const Eigen::Quaterniond q = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5) *
                               Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitY()));
  turned.set("rotation_wxyz", Json::array_of({q.w(), q.x(), q.y(), q.z()}));
  moved.set("translation_m", Json::array_of({1.0, -0.25001, 0.125}));
  EXPECT_THAT(found_with(entry, "body_from_camera", turned), finds("body_from_camera"));
  EXPECT_THAT(found_with(entry, "body_from_camera", moved), finds("body_from_camera"));
  for (const auto& [member, value] : std::map<std::string, Json>{
           {"readout", "down"}, {"line_time_s", 1.02e-5}, {"exposure_s", -1.0}}) {
    Json shutter = entry.shutter();
    shutter.set(member, value);
    EXPECT_THAT(found_with(entry, "shutter", shutter), finds(member.c_str()));
  }
  EXPECT_THAT(found_with(entry, "parameter_names", "fx, fy, cx, cy, k1, k2, p1, p2"),
              finds("parameter_names"));
  EXPECT_THAT(found_with(entry, "rig", "other"), finds("other/fish"));
  EXPECT_THAT(found_with(entry, "camera", "wing"), finds("rig/wing"));
  EXPECT_THAT(found_with(entry, "rays", "rig/other/rays.npy"), finds("rays"));
  EXPECT_THAT(found_with(entry, "origins", "rig/fish/origins.npy"), finds("origins"));
  EXPECT_THAT(found_with(kParallel, "origins", "rig/fish/origins.npy"),
              ElementsAre(HasSubstr("origins")));
}

TEST_F(TerracastReading, OriginsBesideACentralCameraAreAFinding) {
  const Entry entry;
  write(entry, files_of("terracast", entry));
  write_vectors(at(entry, "origins.npy"), [](int, int) { return Vector3d(0.0, 0.0, 0.0); });
  read();
  EXPECT_THAT(findings.lines(), ElementsAre(HasSubstr("origins.npy")));
}

// Where rigs have errors, tables are of what is believed, and images of the cameras as they are.
TEST_F(TerracastReading, RangesAreOfTheTrueCameraWhereTablesAreOfTheBelieved) {
  const Entry truth;
  Entry believed;
  believed.focal_px = 12.6;
  Files files = files_of("terracast", truth);
  Json sequence = files.dataset.at("sequences").at(std::size_t{0});
  sequence.set("calibration", "believed")
      .set("calibration_true", "P000/true.json")
      .set("calibration_believed", "P000/believed.json");
  files.dataset.set("sequences", Json::array().push(sequence));
  files.cameras.set("cameras", Json::array().push(believed.own_file()));
  write(believed, files);
  for (const auto& [file, entry] :
       std::map<std::string, Entry>{{"true", truth}, {"believed", believed}})
    Json::object()
        .set("cameras", Json::array().push(entry.stated()))
        .write(scratch / ("P000/" + file + ".json"));
  write_ranges(truth);
  const Dataset dataset = read();
  EXPECT_THAT(findings.lines(), IsEmpty());
  const Camera& camera = dataset.sequences.at(0).cameras.at(0);
  EXPECT_NEAR(camera.intrinsics.fx_px, 12.0, 1e-12);
  EXPECT_TRUE(rays_results(dataset).at("rays").ok);
  EXPECT_NO_THROW(find_reader("terracast").depth(dataset, camera, 0));
  write_ranges(believed);
  EXPECT_THROW(find_reader("terracast").depth(dataset, camera, 0), core::Error);
}

TEST_F(TerracastReading, TablesAreJudgedInUnitsOfTheirOwn) {
  const auto failed = [&](const Entry& entry) {
    std::vector<std::string> names;
    for (const auto& [name, result] : rays_results(read()))
      if (!result.ok && !result.skipped) names.push_back(name);
    EXPECT_THAT(findings.lines(), IsEmpty()) << entry.name;
    return names;
  };
  const Entry fish;
  const auto is_one = [](int x, int y) { return x == 21 && y == 11; };
  write(fish, files_of("terracast", fish));
  write_vectors(at(fish, "rays.npy"), [&](int x, int y) {
    return Vector3d((is_one(x, y) ? 1.0 + 1e-10 : 1.0) * fish.ray(x, y));
  });
  EXPECT_THAT(failed(fish), ElementsAre("rays_length"));
  write_vectors(at(fish, "rays.npy"), [&](int x, int y) {
    return Vector3d(
        (fish.ray(x, y) + (is_one(x, y) ? 1e-5 : 0.0) * Vector3d::UnitY()).normalized());
  });
  EXPECT_THAT(failed(fish), ElementsAre("rays"));
  // Along its ray: the image cannot tell, but ranges count from there.
  fs::remove_all(scratch / "P000");
  write(kParallel, files_of("terracast", kParallel));
  write_vectors(at(kParallel, "origins.npy"), [&](int x, int y) {
    return Vector3d((x + 0.5 - 0.5 * kWidth) / 4.0, (y + 0.5 - 0.5 * kHeight) / 4.0,
                    is_one(x, y) ? 1e-8 : 0.0);
  });
  EXPECT_THAT(failed(kParallel), ElementsAre("rays_origin"));
}

TEST_F(TerracastReading, ClassesHaveNumbersOfTheirOwnThatImagesCanHold) {
  const Entry entry;
  for (const auto& [text, word] : std::map<std::string, std::string>{
           {R"({"classes": {"sky": 0, "grass": 4294967301}})", "4294967301"},
           {R"({"classes": {"sky": 0, "grass": -1}})", "-1"},
           {R"({"classes": {"sky": 0, "grass": 5, "water": 5}})", "are both 5"}}) {
    Files files = files_of("terracast", entry);
    files.classes = Json::parse(text, "test");
    write(entry, files);
    Findings found;
    read_dataset(scratch.path(), "", found);
    EXPECT_THAT(found.lines(), ElementsAre(AllOf(HasSubstr("classes.json"), HasSubstr(word))));
  }
}

TEST_F(TerracastReading, NormalsAndInstancesAreOfSurfacesAlone) {
  const Entry entry;
  write(entry, files_of("terracast", entry));
  const auto is_surface = [&](int x, int y) { return entry.has_ray(x, y) && y > 10; };
  const float none = std::numeric_limits<float>::quiet_NaN();
  write_array<float>(at(entry, "range/000000.npy"), "<f4", 0, [&](int x, int y, int) {
    if (!entry.has_ray(x, y)) return none;
    return is_surface(x, y) ? 50.0F : std::numeric_limits<float>::infinity();
  });
  const auto found_at = [&](int normal_x, int normal_y, int instance_y) {
    write_array<float>(at(entry, "normal/000000.npy"), "<f4", 3, [&](int x, int y, int k) {
      const bool is_other = x == normal_x && y == normal_y;
      if (is_surface(x, y) == is_other) return none;
      return k == 2 ? 1.0F : 0.0F;
    });
    write_array<std::uint32_t>(at(entry, "instance/000000.npy"), "<u4", 0,
                               [&](int x, int y, int) -> std::uint32_t {
                                 return is_surface(x, y) || (x == 20 && y == instance_y) ? 7 : 0;
                               });
    Findings reading, loading;
    const Dataset dataset = read_dataset(scratch.path(), "", reading);
    EXPECT_THAT(reading.lines(), IsEmpty());
    load_frame(dataset, dataset.sequences.at(0), 0, loading);
    return loading.lines();
  };
  EXPECT_THAT(found_at(-1, -1, -1), IsEmpty());
  EXPECT_THAT(found_at(20, 5, -1), ElementsAre(HasSubstr("normal at pixel (20, 5)")));
  EXPECT_THAT(found_at(20, 20, -1), ElementsAre(HasSubstr("no normal at pixel (20, 20)")));
  EXPECT_THAT(found_at(-1, -1, 5), ElementsAre(HasSubstr("instance 7 at pixel (20, 5)")));
}

// A format that says nothing of cameras has them from dataset.json, whatever their model is.
TEST_F(TerracastReading, CocoTakesTheModelThatIsStated) {
  Entry pinhole = kParallel;
  pinhole.model = "pinhole";
  for (const Entry& entry : {Entry{}, kParallel, pinhole}) {
    const Files files = files_of("coco", entry);
    write(entry, files);
    Findings found;
    const Dataset dataset = read_dataset(scratch.path(), "", found);
    const Camera& camera = dataset.sequences.at(0).cameras.at(0);
    if (entry.model == "pinhole") {
      EXPECT_FALSE(camera.intrinsics.plane);
      continue;
    }
    ASSERT_TRUE(camera.intrinsics.plane) << entry.model;
    EXPECT_EQ(camera.intrinsics.plane->model(), entry.model);
    EXPECT_LT((camera.intrinsics.ray_from_pixel({21.5, 11.5}) - entry.ray(21, 11)).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace terracast::validate
