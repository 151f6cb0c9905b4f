// Tracks against brute force over all triangles of a scene, and bisection for the time of a line. A camera sees it with
// all lines at once, and another with one after the other.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/instance_id.h"
#include "core/json.h"
#include "core/log.h"
#include "core/stop.h"
#include "core/toml_reader.h"
#include "export/exporter.h"
#include "labels/label.h"
#include "labels/track_points.h"
#include "tests/labels/tracks_scene.h"
#include "tests/support/expect_error.h"
#include "tests/support/npz_reader.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using namespace tracked;
using core::ErrorKind;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kPoints = 400;

/// The files of tracks.
struct TrackFiles {
  explicit TrackFiles(const fs::path& folder)
      : points(read_npz(folder / "points.npz")),
        cameras({read_npz(folder / "mcs4/cam0.npz"), read_npz(folder / "mcs4/cam1.npz")}) {}
  std::map<std::string, Array> points;
  std::array<std::map<std::string, Array>, 2> cameras;

  int num_points() const { return points.at("body").shape.at(0); }
  double of_point(const char* name, int n) const { return points.at(name).at({n}); }
  Vector2d query_px(int n) const {
    return {points.at("query_px").at({n, 0}), points.at("query_px").at({n, 1})};
  }
  Vector3d point_world(int n, int frame) const {
    const Array& all = points.at("points_world");
    return {all.at({n, frame, 0}), all.at({n, frame, 1}), all.at({n, frame, 2})};
  }
  double of_camera(int camera, const char* name, int n, int frame) const {
    return cameras.at(static_cast<std::size_t>(camera)).at(name).at({n, frame});
  }
  Vector2d pixel(int camera, int n, int frame) const {
    const Array& all = cameras.at(static_cast<std::size_t>(camera)).at("tracks_px");
    return {all.at({n, frame, 0}), all.at({n, frame, 1})};
  }
};

struct Tracks : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  static inline std::optional<world::TileStore> store;
  static inline std::optional<capture::SequenceReader> sequence;
  static inline std::vector<scene::MovingThing> things;
  static fs::path files() { return *folder / "boxes/labels/tracks"; }

  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    store = make_boxes_world(*folder / "world", kStill);
    things = moving_things();
    sequence = render_plan(*store, plan_of(things), *folder / "boxes");
  }
  static void TearDownTestSuite() {
    sequence.reset();
    store.reset();
    folder.reset();
  }
  static void make(const std::string& more = {}, int num_threads = 0) {
    make_labels_with(*sequence, *store,
                     more.empty() ? fmt::format("kind = \"tracks\"\nnum_points = {}\n", kPoints)
                                  : "kind = \"tracks\"\n" + more,
                     things, num_threads);
  }
  static std::map<std::string, std::string> hashes() {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(files()))
      if (entry.is_regular_file())
        all[entry.path().lexically_relative(files()).string()] =
            core::content_hash_of_file(entry.path());
    return all;
  }
};

/// How often each case came up.
struct Tally {
  int visible = 0, hidden_by_standing = 0, hidden_by_moving = 0, beside = 0, behind = 0, gone = 0,
      on_bar = 0, unsure = 0;
};

/// A point in an image, against brute force.
void check_element(const TrackFiles& tracks, const Truth& truth, const Truth::Shown& shown, int n,
                   int frame, int camera, Tally& tally) {
  const Vector2d pixel = tracks.pixel(camera, n, frame);
  const double range_m = tracks.of_camera(camera, "range_m", n, frame);
  const bool is_in_image = tracks.of_camera(camera, "in_image", n, frame) != 0.0;
  const bool is_visible = tracks.of_camera(camera, "visible", n, frame) != 0.0;
  const auto occluder = static_cast<std::uint32_t>(tracks.of_camera(camera, "occluder", n, frame));
  const auto expect_nothing = [&] {
    EXPECT_TRUE(std::isnan(pixel.x()) && std::isnan(pixel.y()) && std::isnan(range_m));
    EXPECT_TRUE(!is_in_image && !is_visible && occluder == 0);
  };
  const int body = shown.hit.body;
  if (body >= 0 && !truth.state(frame, body)) {
    ++tally.gone;
    return expect_nothing();
  }
  const auto point_at = [&](double t) -> Vector3d {
    return body < 0 ? shown.own : Pose(*truth.state(frame, body), t).world(shown.own);
  };
  const auto in_camera = [&](double t) -> Vector3d {
    return truth.camera_pose(frame, t).own(point_at(t));
  };
  // Over the time that is looked through it stays before the camera, or behind it.
  const double reach_s = camera == 0 ? 0.0 : 8.0 * kHeight * kLineTime_s;
  double nearest_m = kInfinity, farthest_m = -kInfinity;
  for (int step = -8; step <= 8; ++step) {
    const double depth_m = in_camera(step * reach_s / 8.0).z();
    nearest_m = std::min(nearest_m, depth_m);
    farthest_m = std::max(farthest_m, depth_m);
  }
  if (farthest_m < -1.0) {
    ++tally.behind;
    return expect_nothing();
  }
  if (nearest_m < 1.0) {
    ++tally.unsure;
    return;
  }
  const auto pixel_at = [&](double t) { return pixel_of(in_camera(t)); };
  const double t =
      camera == 0 ? 0.0 : time_seen(reach_s, [&](double time) { return pixel_at(time).y(); });
  if (std::abs(Truth::time_of(camera, pixel_at(t).y()) - t) > 1e-12) {  // it is farther off
    ++tally.unsure;
    return;
  }
  // The time of a line is known to a millionth of it, in which nothing moves by more than that of a pixel; far beside
  // the image pixels grow with the square of the tangent.
  const double tolerance_px = 1e-6 * std::max(1.0, pixel_at(t).squaredNorm() / 1e6);
  EXPECT_LE((pixel - pixel_at(t)).norm(), tolerance_px);
  const Pose eye = truth.camera_pose(frame, t);
  const Vector3d way = point_at(t) - eye.place;
  EXPECT_NEAR(range_m, way.norm(), 1e-7);
  const Vector2d there = pixel_at(t);
  const double to_edge = std::min({there.x(), there.y(), kWidth - there.x(), kHeight - there.y()});
  if (std::abs(to_edge) < 1e-6) {
    ++tally.unsure;
    return;
  }
  EXPECT_EQ(is_in_image, to_edge > 0.0);
  if (to_edge < 0.0) {
    EXPECT_TRUE(!is_visible && occluder == 0);
    ++tally.beside;
    return;
  }
  const auto first = [&](double grown) { return truth.meet(frame, t, eye.place, way, grown); };
  const auto is_point = [&](const Hit& met) {
    return met.is_same(shown.hit) && std::abs(met.t - 1.0) < 1e-6;
  };
  const Hit met = first(0.0);
  if (is_point(first(kRim_m)) != is_point(first(-kRim_m)) ||
      first(kRim_m).instance_id != first(-kRim_m).instance_id) {
    ++tally.unsure;
    return;
  }
  EXPECT_EQ(is_visible, is_point(met));
  EXPECT_EQ(occluder, is_point(met) ? 0U : met.instance_id);
  if (is_visible && body == kBar) ++tally.on_bar;
  ++(is_visible      ? tally.visible
     : met.body >= 0 ? tally.hidden_by_moving
                     : tally.hidden_by_standing);
}

TEST_F(Tracks, AreThoseOfBruteForce) {
  make();
  const TrackFiles tracks(files());
  const Truth truth(*sequence);
  ASSERT_EQ(tracks.num_points(), kPoints);
  EXPECT_EQ(tracks.points.at("points_world").shape, (std::vector<int>{kPoints, kFrames, 3}));
  EXPECT_EQ(tracks.cameras[1].at("tracks_px").shape, (std::vector<int>{kPoints, kFrames, 2}));
  Tally global, rolling;
  int num_moving = 0, num_unsure_queries = 0;
  std::map<std::pair<int, int>, int> num_of_image;  // frame, camera
  std::map<double, int> num_on;                     // body
  for (int n = 0; n < kPoints; ++n) {
    SCOPED_TRACE(testing::Message() << "point " << n);
    if (testing::Test::HasFailure()) return;
    const auto query_frame = static_cast<int>(tracks.of_point("query_frame", n));
    const auto query_camera = static_cast<int>(tracks.of_point("query_camera", n));
    const Vector2d query_px = tracks.query_px(n);
    const auto body = static_cast<int>(tracks.of_point("body", n));
    num_moving += body >= 0 ? 1 : 0;
    ++num_on[body];
    if (body < 0) ++num_of_image[{query_frame, query_camera}];
    EXPECT_EQ(num_moving, (n + 1) / 4);  // a quarter, and of any first points too
    // Where it was drawn it is seen at the very pixel.
    EXPECT_EQ(query_px, (query_px.array().floor() + 0.5).matrix());
    EXPECT_LE((tracks.pixel(query_camera, n, query_frame) - query_px).norm(), 1e-6);
    EXPECT_EQ(tracks.of_camera(query_camera, "visible", n, query_frame), 1.0);

    const std::optional<Truth::Shown> shown = truth.shown(query_frame, query_camera, query_px);
    if (!shown) {
      ++num_unsure_queries;
      continue;
    }
    ASSERT_EQ(body, shown->hit.body);
    EXPECT_EQ(tracks.of_point("instance_id", n), shown->hit.instance_id);
    for (int frame = 0; frame < kFrames; ++frame) {
      SCOPED_TRACE(testing::Message() << "frame " << frame);
      const bool is_present = body < 0 || truth.state(frame, body);
      EXPECT_EQ(tracks.points.at("is_present").at({n, frame}) != 0.0, is_present);
      const Vector3d place = tracks.point_world(n, frame);
      if (is_present) {
        const Vector3d expected =
            body < 0 ? shown->own : Pose(*truth.state(frame, body), 0.0).world(shown->own);
        // Roundings of rays of 900 m that graze the ground.
        EXPECT_LE((place - expected).norm(), 1e-8);
      } else {
        EXPECT_TRUE(place.array().isNaN().all());
      }
      check_element(tracks, truth, *shown, n, frame, 0, global);
      check_element(tracks, truth, *shown, n, frame, 1, rolling);
    }
  }
  EXPECT_LT(num_unsure_queries, kPoints / 5);  // most of them beyond 900 m
  for (const Tally& tally : {global, rolling}) {
    EXPECT_GT(tally.visible, 300);
    EXPECT_GT(tally.hidden_by_standing, 30);
    EXPECT_GT(tally.hidden_by_moving, 10);
    EXPECT_GT(tally.beside, 50);
    EXPECT_GT(tally.behind, 50);
    EXPECT_GT(tally.gone, 20);
    EXPECT_GT(tally.on_bar, 5);
    EXPECT_LT(tally.unsure, 40);
  }
  // Images in turn, of each image each thing in turn.
  EXPECT_EQ(num_of_image.size(), 2U * kFrames);
  for (const auto& [image, count] : num_of_image) EXPECT_NEAR(count, 300.0 / 8.0, 2.0);
  EXPECT_GT(num_on[0], 15);
  EXPECT_GT(num_on[2], 15);
  EXPECT_GT(num_on[3], 10);
}

TEST_F(Tracks, SameBytesForAnyThreadsAndInterruptions) {
  make({}, 1);
  const auto all = hashes();
  EXPECT_EQ(all.size(), 7U);
  fs::remove_all(files());
  make({}, 2);
  EXPECT_EQ(hashes(), all);

  // Cut off while the second camera was being made, and a file damaged since.
  for (const char* name : {"tracks.json", "mcs4/cam1.json"}) fs::remove(files() / name);
  fs::resize_file(files() / "points.npz", 1000);
  const auto time = fs::last_write_time(files() / "mcs4/cam0.npz");
  core::ask_to_stop();
  expect_error(ErrorKind::Interrupted, {"stopped on request"}, [&] { make(); });
  core::forget_stop();
  EXPECT_FALSE(fs::exists(files() / "tracks.json"));
  make();
  EXPECT_EQ(hashes(), all);
  EXPECT_EQ(fs::last_write_time(files() / "mcs4/cam0.npz"), time);
  make();
  EXPECT_EQ(fs::last_write_time(files() / "mcs4/cam0.npz"), time);

  // Of other options all is made again, and what is not of them is gone.
  make(fmt::format("num_points = {}\nseed = 2\ncameras = [\"mcs4/cam1\"]\n", kPoints));
  const auto other = hashes();
  EXPECT_EQ(other.size(), 5U);
  EXPECT_FALSE(other.contains("mcs4/cam0.npz"));
  EXPECT_NE(other.at("points.npz"), all.at("points.npz"));
  const auto points = read_npz(files() / "points.npz");
  for (const double camera : points.at("query_camera").numbers) EXPECT_EQ(camera, 0.0);
  EXPECT_EQ(core::Json::read(files() / "tracks.json").at("cameras").strings(),
            std::vector<std::string>{"mcs4/cam1"});
}

TEST_F(Tracks, SharesOfWhatMovesAreAsAskedForAndAsThereIs) {
  make("num_points = 60\nmoving_share = 0.0\n");
  const auto bodies_of = [&] { return read_npz(files() / "points.npz").at("body").numbers; };
  for (const double body : bodies_of()) EXPECT_EQ(body, -1.0);
  make("num_points = 60\nmoving_share = 1.0\n");
  for (const double body : bodies_of()) EXPECT_GE(body, 0.0);

  // More than there are pixels that show something: each of them is drawn, but where it is rounding that says what a ray
  // to its point meets, which is at edges alone. Here none is left out.
  make(fmt::format("num_points = {}\nmoving_share = 1.0\n", 2 * kFrames * kWidth * kHeight));
  const auto all = read_npz(files() / "points.npz");
  std::map<std::array<double, 4>, bool> is_moving;  // of frame, camera, x, y
  for (int n = 0; n < all.at("body").shape[0]; ++n)
    is_moving[{all.at("query_frame").at({n}), all.at("query_camera").at({n}),
               all.at("query_px").at({n, 0}), all.at("query_px").at({n, 1})}] =
        all.at("body").at({n}) >= 0.0;
  EXPECT_EQ(is_moving.size(), static_cast<std::size_t>(all.at("body").shape[0]));
  std::size_t num_drawn = 0;
  for (int frame = 0; frame < kFrames; ++frame)
    for (int camera = 0; camera < 2; ++camera) {
      const auto facts = sequence->read_camera(frame, camera, capture::SequenceReader::kFacts);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          if (!std::isfinite(facts.range_m(x, y))) continue;
          const auto drawn = is_moving.find({double(frame), double(camera), x + 0.5, y + 0.5});
          if (drawn == is_moving.end()) {
            EXPECT_NE(facts.flags(x, y) & capture::kEdge, 0U)
                << "frame " << frame << " camera " << camera << " at " << x << " " << y;
            continue;
          }
          ++num_drawn;
          EXPECT_EQ(drawn->second, core::is_moving_id(facts.instance_id(x, y)));
        }
    }
  EXPECT_EQ(num_drawn, is_moving.size());  // none of the sky
}

// Flow follows from the capture's facts alone.
TEST_F(Tracks, StepsAreTheFlowOfTheExport) {
  make();
  exporters::ExportOptions options;
  core::TomlDocument::parse("format = \"terracast\"\nmodalities = [\"flow\"]\n", "test.toml")
      .read(options);
  const core::Log log("export", core::LogLevel::Off);
  exporters::run_export_stage({capture::SequenceReader::open(*folder / "boxes")}, {options},
                              *folder / "out", {.log = log});
  const TrackFiles tracks(files());
  std::map<fs::path, Array> flows;
  int num_steps = 0, num_moving = 0, num_without = 0;
  for (int n = 0; n < kPoints; ++n) {
    SCOPED_TRACE(testing::Message() << "point " << n);
    const auto frame = static_cast<int>(tracks.of_point("query_frame", n));
    const auto camera = static_cast<int>(tracks.of_point("query_camera", n));
    if (frame + 1 == kFrames) continue;
    const fs::path file =
        *folder /
        fmt::format("out/terracast/boxes/mcs4/cam{}/flow_forward/{:06}.npy", camera, frame);
    if (!flows.contains(file)) flows[file] = parse_npy(core::read_text_file(file));
    const Vector2d query = tracks.query_px(n);
    const auto x = static_cast<int>(query.x()), y = static_cast<int>(query.y());
    const Array& flow = flows[file];
    const Vector2d exported(flow.at({y, x, 0}), flow.at({y, x, 1}));
    const Vector2d step = tracks.pixel(camera, n, frame + 1) - query;
    EXPECT_EQ(std::isnan(exported.x()), std::isnan(step.x()));
    num_without += std::isnan(step.x()) ? 1 : 0;
    if (tracks.of_camera(camera, "in_image", n, frame + 1) == 0.0) continue;
    const auto& bound = sequence->frames()[static_cast<std::size_t>(frame)]
                            .cameras[static_cast<std::size_t>(camera)]
                            .bounds.flow_next_px;
    ASSERT_TRUE(bound.has_value());
    EXPECT_LT(bound->arithmetic + bound->rounding, 1e-3);
    EXPECT_LE((exported - step).norm(), bound->arithmetic + bound->rounding + 1e-6);
    ++num_steps;
    num_moving += tracks.of_point("body", n) >= 0.0 ? 1 : 0;
  }
  EXPECT_GT(num_steps, 150);
  EXPECT_GT(num_moving, 40);
  EXPECT_GT(num_without, 10);
}

TEST_F(Tracks, OfTheSkyAreEmpty) {
  render::SequencePlan plan = level_plan(2);
  for (geo::BodyState& state : plan.states)
    state.world_from_body.rotation =
        Eigen::AngleAxisd(-0.5 * std::numbers::pi, Vector3d::UnitY());  // x up
  plan.cameras.push_back(plan.cameras[0]);
  plan.cameras[1].name = "cam1";
  const auto sky = render_plan(*store, plan, *folder / "sky");
  make_labels_with(sky, *store, "kind = \"tracks\"\n");
  const TrackFiles tracks(*folder / "sky/labels/tracks");
  EXPECT_EQ(tracks.points.at("points_world").shape, (std::vector<int>{0, 2, 3}));
  EXPECT_EQ(tracks.points.at("time_s").numbers, (std::vector<double>{0.0, 0.1}));
  EXPECT_EQ(tracks.cameras[0].at("tracks_px").shape, (std::vector<int>{0, 2, 2}));
  EXPECT_EQ(tracks.cameras[1].at("visible").shape, (std::vector<int>{0, 2}));
  EXPECT_EQ(core::Json::read(*folder / "sky/labels/tracks/tracks.json").at("points").integer(), 0);
}

TEST_F(Tracks, OptionsThatCannotBeAreRefusedBeforeRendering) {
  const core::Log log("label", core::LogLevel::Off);
  const auto check = [&](const std::string& more) {
    const std::vector<labels::SequenceOutline> job = {
        {.name = "short", .cameras = level_plan().cameras, .num_frames = 10},
        {.name = "long", .cameras = level_plan().cameras, .num_frames = 100000}};
    std::vector<labels::LabelOptions> options(1);
    core::TomlDocument::parse("kind = \"tracks\"\n" + more, "job.toml").read(options[0]);
    labels::check_labels(options, job, log);
  };
  check("num_points = 1000\n");
  check("num_points = 10\ncameras = [\"mcs4/cam0\"]\n");
  expect_error(ErrorKind::Config, {"long", "num_points = 1000 is the most"},
               [&] { check("num_points = 1001\n"); });
  expect_error(ErrorKind::Config, {"mcs4/cam7", "mcs4/cam0"},
               [&] { check("num_points = 10\ncameras = [\"mcs4/cam7\"]\n"); });
  expect_error(ErrorKind::Config, {"moving_share", "1.5"}, [&] { check("moving_share = 1.5\n"); });
}

// Asked where it is installed: python3 with Debian's or PyPI's numpy.
TEST_F(Tracks, AreReadByNumpy) {
  if (run_command("python3", {"-c", "import numpy"}).status != 0)
    GTEST_SKIP() << "python3 has no numpy";
  make();
  const std::string script =
      "import sys, numpy as np\n"
      "p = np.load(sys.argv[1] + '/points.npz'); c = np.load(sys.argv[1] + '/mcs4/cam1.npz')\n"
      "for f in (p, c):\n"
      "  for name in f.files: print(name, f[name].dtype.str, f[name].shape)\n"
      "v = c['visible']\n"
      "print('visible', int(v.sum()), 'inside', bool((v <= c['in_image']).all()))\n"
      "print('nan', int(np.isnan(c['tracks_px']).any(-1).sum()))\n";
  const auto ran = run_command("python3", {"-c", script, files().string()});
  ASSERT_EQ(ran.status, 0) << ran.output;
  for (const char* line :
       {"points_world <f8 (400, 4, 3)", "is_present |b1 (400, 4)", "instance_id <u4 (400,)",
        "body <i4 (400,)", "query_px <f8 (400, 2)", "time_s <f8 (4,)", "tracks_px <f8 (400, 4, 2)",
        "in_image |b1 (400, 4)", "occluder <u4 (400, 4)", "range_m <f8 (400, 4)", "inside True"})
    EXPECT_THAT(ran.output, testing::HasSubstr(line));
  const TrackFiles tracks(files());
  int num_visible = 0, num_nan = 0;
  for (int n = 0; n < kPoints; ++n)
    for (int frame = 0; frame < kFrames; ++frame) {
      num_visible += tracks.of_camera(1, "visible", n, frame) != 0.0 ? 1 : 0;
      num_nan += std::isnan(tracks.pixel(1, n, frame).x()) ? 1 : 0;
    }
  EXPECT_THAT(ran.output, testing::HasSubstr(fmt::format("visible {} ", num_visible)));
  EXPECT_THAT(ran.output, testing::HasSubstr(fmt::format("nan {}\n", num_nan)));
}

TEST(GoldenOrder, HasEachPlaceOnceAndEachRunSpread) {
  for (const std::size_t count : {0U, 1U, 2U, 3U, 10U, 40U, 89U, 1000U, 9000U}) {
    const std::vector<std::size_t> order = labels::golden_order(count);
    EXPECT_EQ(std::set(order.begin(), order.end()).size(), count);
    for (const std::size_t place : order) EXPECT_LT(place, count);
    if (count < 40) continue;
    // Of the first 16 two lie in each quarter and more.
    std::array<int, 4> quarters{};
    for (std::size_t i = 0; i < 16; ++i) ++quarters[order[i] * 4 / count];
    for (const int in_quarter : quarters) EXPECT_GE(in_quarter, 2) << count;
  }
}

}  // namespace
}  // namespace terracast::test
