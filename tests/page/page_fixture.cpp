// Writes the datasets and the truth that tests/page/page_test.mjs opens reports of.
//   terracast_page_fixture OUT     OUT/kitti, OUT/tartanair: datasets; OUT/truth.json
#include <fmt/format.h>

#include <exception>
#include <filesystem>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/log.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/check.h"

namespace {

namespace fs = std::filesystem;
using terracast::core::Json;
using terracast::test::Recording;

/// A world that would be a script, were it ever taken for HTML.
constexpr const char* kHostileName = "</script><img src=x onerror=\"window.isBroken=1\">&\"'";

void rename_world(const fs::path& dataset) {
  Json json = Json::read(dataset / "dataset.json");
  Json world = json.at("world");
  json.set("world", world.set("name", kHostileName));
  json.write(dataset / "dataset.json");
}

/// Where the point of a pixel of one frame stands in the next, less the pixel.
Eigen::Vector2d flow_of(const Recording& recording, std::size_t frame, int x, int y) {
  const auto& camera = recording.cameras[0];
  const Eigen::Vector2d centre(0.5 * camera.width, 0.5 * camera.height);
  const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
  const Eigen::Vector3d ray((pixel.x() - centre.x()) / camera.focal_px,
                            (pixel.y() - centre.y()) / camera.focal_px, 1.0);
  const Eigen::Vector3d point =
      recording.rotation(0, frame) * (ray * recording.depth[0][frame](x, y)) +
      recording.centre(0, frame);
  const Eigen::Vector3d there =
      recording.rotation(0, frame + 1).transpose() * (point - recording.centre(0, frame + 1));
  return camera.focal_px * Eigen::Vector2d(there.x() / there.z(), there.y() / there.z()) + centre -
         pixel;
}

Json truth_of(const Recording& recording, std::size_t frame, int x, int y) {
  const Eigen::Vector2d flow = flow_of(recording, frame, x, y);
  return Json::object()
      .set("frame", static_cast<std::int64_t>(frame))
      .set("x", x)
      .set("y", y)
      .set("depth_m", static_cast<double>(static_cast<float>(recording.depth[0][frame](x, y))))
      .set("flow_px", Json::array_of({flow.x(), flow.y()}));
}

void write(const fs::path& out) {
  using namespace terracast;
  const core::Log log("validate", core::LogLevel::Off);
  // One disparity is wrong by 8/256 px: in frame 1, at (80, 64).
  const Recording pair = test::record_flight(test::kitti_cameras(), 3);
  test::write_kitti(pair, out / "data/kitti", {.one_disparity_counts = 8});
  rename_world(out / "data/kitti");
  // Odd places in an image that is taken at every second pixel.
  const Recording wide = test::record_flight(test::tartanair_cameras(), 3);
  test::write_tartanair(wide, out / "data/tartanair");
  for (const char* format : {"kitti", "tartanair"})
    validate::run_validate_stage(out / "data" / format, {}, out / "report" / format, {log});
  validate::join_reports(out / "report", {"kitti", "tartanair"});
  Json::object()
      .set("hostile_name", kHostileName)
      .set("kitti", truth_of(pair, 1, 80, 64))
      .set("tartanair",
           Json::array().push(truth_of(wide, 0, 321, 401)).push(truth_of(wide, 1, 101, 555)))
      .write(out / "truth.json");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: terracast_page_fixture OUT\n");
    return 2;
  }
  try {
    write(argv[1]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return 70;
  }
  return 0;
}
