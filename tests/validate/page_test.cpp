#include <gtest/gtest.h>
#include <libdeflate.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/log.h"
#include "tests/support/folder_compare.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_writer.h"
#include "validate/check.h"
#include "validate/page_bundle.h"
#include "validate/page_ground.h"
#include "validate/page_images.h"
#include "validate/page_values.h"
#include "validate/place.h"
#include "validate/report.h"
#include "validate/report_page.h"

/// What the report's page is given: places, images, values and files. The page itself is tested in a
/// browser, tests/page.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

Dataset two_cameras(int num_frames, const std::vector<std::string>& names = {"left", "left up"}) {
  Dataset dataset;
  Sequence sequence;
  sequence.name = "flight";
  sequence.num_frames = num_frames;
  for (const std::string& name : names) {
    Camera camera;
    camera.name = name;
    camera.intrinsics = {64, 48, 50.0, 50.0, 32.0, 24.0};
    camera.files.resize(static_cast<std::size_t>(num_frames));
    camera.local_from_camera.resize(static_cast<std::size_t>(num_frames));
    sequence.cameras.push_back(camera);
  }
  if (num_frames > 1) sequence.cameras[0].files[1].color = "images/a/000001.png";
  dataset.sequences.push_back(sequence);
  return dataset;
}

TEST(PagePlace, IsTheImageThatTheWordsName) {
  const Dataset dataset = two_cameras(12);
  const auto place = [&](const char* worst) { return place_in(worst, dataset); };
  EXPECT_EQ(place("left, frame 3"), (Place{0, 0, 3, {}}));
  EXPECT_EQ(place("left up, frame 11, pixel (63, 0): seen"),
            (Place{0, 1, 11, Eigen::Vector2i(63, 0)}));
  // Of a pair the image that is named first.
  EXPECT_EQ(place("left up, frame 2 in left, frame 1"), (Place{0, 1, 2, {}}));
  EXPECT_EQ(place("all cameras alike, frame 5, x"), (Place{0, 0, 5, {}}));
  EXPECT_EQ(place("frame 7"), (Place{0, 0, 7, {}}));
  EXPECT_EQ(place("binary model, image a/000001.png, observation 3"), (Place{0, 0, 1, {}}));
  EXPECT_EQ(place("images/a/000001.png: 3 bytes"), (Place{0, 0, 1, {}}));
}

TEST(PagePlace, IsNoneWhereTheDatasetHasNoSuchImage) {
  const Dataset dataset = two_cameras(12);
  for (const char* worst :
       {"", "left, frame 12", "left, frame -1", "left, frame x", "left, all frames",
        "left, frame 99999999999999999999", "right, frame 1", "frame", "2 of 3 pairs agree"})
    EXPECT_EQ(place_in(worst, dataset), std::nullopt) << worst;
  // A pixel outside the image marks nothing.
  EXPECT_EQ(place_in("left, frame 1, pixel (64, 0)", dataset), (Place{0, 0, 1, {}}));
  EXPECT_EQ(place_in("left, frame 1", Dataset{}), std::nullopt);
}

TEST(PagePlace, HasTheSequenceBeforeItWhereThereAreSeveral) {
  Dataset dataset = two_cameras(4);
  dataset.sequences.push_back(dataset.sequences[0]);
  dataset.sequences[1].name = "flight: b";
  EXPECT_EQ(place_in("flight: left, frame 3", dataset), (Place{0, 0, 3, {}}));
  EXPECT_EQ(place_in("flight: b: left, frame 3", dataset), (Place{1, 0, 3, {}}));
  EXPECT_EQ(place_in("left, frame 3", dataset), std::nullopt);
}

TEST(PageImages, AreBoundedAndHoldTheWorstOfEachCheck) {
  const Dataset few = two_cameras(3);
  EXPECT_EQ(choose_page_images(few, {}).size(), 6U);
  std::vector<std::string> names(6);
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = std::to_string(i);
  const Dataset many = two_cameras(100, names);
  const std::vector<Place> worst = {
      {0, 5, 57, Eigen::Vector2i(1, 2)}, {0, 5, 57, {}}, {0, 1, 0, {}}};
  const std::vector<Place> chosen = choose_page_images(many, worst);
  EXPECT_EQ(chosen.size(), 61U) << "ten frames of six cameras, and one more image";
  const auto holds = [&](int camera, int frame) {
    return std::find(chosen.begin(), chosen.end(), Place{0, camera, frame, {}}) != chosen.end();
  };
  EXPECT_TRUE(holds(5, 57));
  for (int camera = 0; camera < 6; ++camera) {
    EXPECT_TRUE(holds(camera, 0));
    EXPECT_TRUE(holds(camera, 99));
  }
  const Dataset crowd = two_cameras(2, std::vector<std::string>(256, "c"));
  EXPECT_LE(choose_page_images(crowd, {}).size(),
            static_cast<std::size_t>(std::max(kPageImages, 2 * kPageCameras)));
  EXPECT_TRUE(choose_page_images(two_cameras(0), {}).empty());
}

/// What `packed` holds, by code of its own: base64, zlib, byte planes of differences.
template <class Value, class Bits>
std::vector<Value> unpacked(const core::Json& packed) {
  static constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t group = 0;
  int num_bits = 0;
  for (const char c : packed.at("data").string()) {
    if (c == '=') break;
    group = group << 6 | static_cast<std::uint32_t>(kLetters.find(c));
    num_bits += 6;
    if (num_bits < 8) continue;
    num_bits -= 8;
    bytes += static_cast<char>(group >> num_bits & 255U);
  }
  const auto count = static_cast<std::size_t>(packed.at("count").integer());
  std::vector<std::uint8_t> planes(count * sizeof(Bits));
  libdeflate_decompressor* decompressor = libdeflate_alloc_decompressor();
  std::size_t size = 0;
  EXPECT_EQ(libdeflate_zlib_decompress(decompressor, bytes.data(), bytes.size(), planes.data(),
                                       planes.size(), &size),
            LIBDEFLATE_SUCCESS);
  libdeflate_free_decompressor(decompressor);
  EXPECT_EQ(size, planes.size());
  std::vector<Value> values(count);
  Bits bits = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Bits difference = 0;
    for (std::size_t k = 0; k < sizeof(Bits); ++k)
      difference =
          static_cast<Bits>(difference | static_cast<Bits>(planes[k * count + i]) << 8 * k);
    bits = static_cast<Bits>(bits + difference);
    std::memcpy(&values[i], &bits, sizeof(Bits));
  }
  return values;
}

TEST(PageValues, ArePackedExactlyToTheBit) {
  const std::vector<float> floats = {0.0F,
                                     -0.0F,
                                     784.53766F,
                                     std::nextafter(784.53766F, 0.0F),
                                     std::numeric_limits<float>::infinity(),
                                     std::numeric_limits<float>::quiet_NaN(),
                                     std::numeric_limits<float>::denorm_min(),
                                     -3e38F};
  const std::vector<float> back = unpacked<float, std::uint32_t>(packed(floats));
  ASSERT_EQ(back.size(), floats.size());
  EXPECT_EQ(std::memcmp(back.data(), floats.data(), 4 * floats.size()), 0);
  const std::vector<std::int16_t> shorts = {0, -32768, 32767, -1, 5, 5};
  EXPECT_EQ((unpacked<std::int16_t, std::uint16_t>(packed(shorts))), shorts);
  const std::vector<std::uint8_t> bytes = {255, 0, 255, 7};
  EXPECT_EQ((unpacked<std::uint8_t, std::uint8_t>(packed(bytes))), bytes);
  EXPECT_TRUE((unpacked<float, std::uint32_t>(packed(std::vector<float>{}))).empty());
}

TEST(PageValues, Base64IsThatOfRfc4648) {
  const auto encoded = [](std::string_view text) {
    return base64(std::as_bytes(std::span(text.data(), text.size())));
  };
  EXPECT_EQ(encoded(""), "");
  EXPECT_EQ(encoded("f"), "Zg==");
  EXPECT_EQ(encoded("fo"), "Zm8=");
  EXPECT_EQ(encoded("foobar"), "Zm9vYmFy");
}

TEST(PageValues, NothingInAScriptEndsIt) {
  const std::string script = script_call(
      "take", core::Json::object().set("name", "</script><!--<script>alert(1)//").set("n", 1));
  EXPECT_EQ(script.find('<'), std::string::npos) << script;
  EXPECT_EQ(script.find('>'), std::string::npos) << script;
  // The text is the same.
  const std::string json = script.substr(5, script.size() - 5 - 3);
  EXPECT_EQ(core::Json::parse(json, "script").at("name").string(),
            "</script><!--<script>alert(1)//");
}

TEST(PageText, IsEscapedWhereverADatasetSpeaks) {
  CheckResult result;
  result.name = "a\"><img src=x>";
  result.worst = result.unit = result.summary = result.reason = result.detects =
      "<script>x</script>";
  const std::string html = dataset_page("<title>&", {"</p><script>"}, report_json({result}));
  const std::string start = start_page({{"<i>", report_json({result}), ""}}, report_json({result}),
                                       core::Json::array(), false);
  for (const std::string& page : {html, start}) {
    EXPECT_EQ(page.find("<script>x"), std::string::npos);
    EXPECT_EQ(page.find("<img src=x"), std::string::npos);
    EXPECT_EQ(page.find("<title>&<"), std::string::npos);
    EXPECT_EQ(page.find("<i>"), std::string::npos);
  }
  EXPECT_EQ(html.find("</p><script>"), std::string::npos);
}

TEST(PageText, NamesTheCausesThatAReportHasAndTheJoinedPageToo) {
  const test::ScratchFolder scratch;
  CheckResult flow;
  flow.name = "flow";
  core::Json report = report_json({flow});
  EXPECT_EQ(dataset_page("", {}, report).find("class=\"causes\""), std::string::npos);
  report.set("causes", core::Json::array().push(core::Json::object().set("words", "late < clock")));
  EXPECT_NE(dataset_page("", {}, report).find("<li>late &lt; clock</li>"), std::string::npos);
  report.write(scratch / "kitti/report.json");
  EXPECT_FALSE(join_reports(scratch.path(), {"kitti"}));
  EXPECT_NE(core::read_text_file(scratch / "index.html").find("<li>kitti: late &lt; clock</li>"),
            std::string::npos);
}

TEST(PageStages, TakeTheNewestOfEachAndPassOverWhatIsNone) {
  const test::ScratchFolder scratch;
  core::write_file(
      scratch / "events.jsonl",
      std::string_view("cut off\"stage\"}\n"
                       "{\"what\":\"stage\",\"stage\":\"tile\",\"wall_s\":5,\"cpu_s\":9,"
                       "\"peak_bytes\":1e6}\n"
                       "{\"what\":\"progress\",\"stage\":\"tile\"}\n"
                       "{\"what\":\"stage\",\"stage\":7}\n"
                       "{\"what\":\"stage\",\"stage\":\"render\",\"wall_s\":1,\"cpu_s\":2,"
                       "\"peak_bytes\":3}\n"
                       "{\"what\":\"stage\",\"stage\":\"tile\",\"wall_s\":0.5,\"cpu_s\":1,"
                       "\"peak_bytes\":2e6}\n"));
  const core::Json costs = stage_costs(scratch / "events.jsonl");
  ASSERT_EQ(costs.size(), 2U);
  EXPECT_EQ(costs.at(0).at("stage").string(), "tile");
  EXPECT_EQ(costs.at(0).at("wall_s").number(), 0.5);
  EXPECT_EQ(costs.at(1).at("stage").string(), "render");
  EXPECT_EQ(stage_costs(scratch / "missing").size(), 0U);
  EXPECT_EQ(stage_costs({}).size(), 0U);
}

TEST(PagePlots, KeepTheirPeaksWhenThinned) {
  CheckResult::Plot plot;
  for (int i = 0; i < 100'000; ++i) {
    plot.x.push_back(i);
    plot.y.push_back(i == 77'777 ? 5.0 : i == 12'345 ? -4.0 : 0.0);
  }
  const CheckResult::Plot thin = thinned(plot, 3000);
  EXPECT_LE(thin.x.size(), 3002U);
  EXPECT_EQ(thin.x.size(), thin.y.size());
  EXPECT_EQ(*std::max_element(thin.y.begin(), thin.y.end()), 5.0);
  EXPECT_EQ(*std::min_element(thin.y.begin(), thin.y.end()), -4.0);
  EXPECT_TRUE(std::is_sorted(thin.x.begin(), thin.x.end()));
  EXPECT_EQ(thinned(plot, 200'000).y, plot.y);
}

TEST(PageHistogram, PutsValuesIntoQuartersOfOctaves) {
  OctaveHistogram histogram;
  EXPECT_TRUE(histogram.json().is_null());
  for (const double value : {1.0, 1.1, 1.25, 8.0, 0.0, -1.0, std::nan(""), 1e300})
    histogram.add(value);
  const core::Json json = histogram.json();
  // 1 to 2^(1/4) = 1.189 holds two, the next bin one, and that of 8 is the 13th.
  ASSERT_EQ(json.at("counts").size(), 13U);
  EXPECT_EQ(json.at("counts").at(0).integer(), 2);
  EXPECT_EQ(json.at("counts").at(1).integer(), 1);
  EXPECT_EQ(json.at("counts").at(12).integer(), 1);
  EXPECT_DOUBLE_EQ(json.at("edges").at(0).number(), 1.0);
  EXPECT_DOUBLE_EQ(json.at("edges").at(4).number(), 2.0);
}

/// A dataset of the scene in closed form, read back.
struct Scene {
  explicit Scene(const fs::path& folder)
      : recording(test::record_flight(test::kitti_cameras(), 3)) {
    test::write_kitti(recording, folder);
    dataset = read_dataset(folder, "", findings);
  }
  test::Recording recording;
  Findings findings;
  Dataset dataset;
};

TEST(PageImage, HoldsTheVeryDepthsAndPlacesOfTheScene) {
  const test::ScratchFolder scratch;
  const Scene scene(scratch / "data");
  const PageImage page = make_page_image(scene.dataset, {0, 0, 1, {}}, 0);
  ASSERT_EQ(page.step, 1);
  ASSERT_EQ(page.width, 160);
  for (int y = 0; y < page.height; y += 7)
    for (int x = 0; x < page.width; x += 7)
      ASSERT_EQ(page.depth(x, y), static_cast<float>(scene.recording.depth[0][1](x, y)));
  EXPECT_EQ(page.layers, (std::vector<std::string>{"depth", "residual", "disparity"}));
  EXPECT_EQ(page.residual_frame, 2);
  ASSERT_EQ(page.footprint.size(), 32U);
  // The first sample is the image's corner: its point, by the scene's own pose, about the first
  // camera's place. The two frames' axes differ by the Earth's curve over the flight, and poses
  // have nine digits: a centimetre is plenty.
  const test::SceneCamera& camera = scene.recording.cameras[0];
  const double depth_m = scene.recording.depth[0][1](0, 0);
  const Eigen::Vector3d ray((0.5 - 0.5 * camera.width) / camera.focal_px,
                            (0.5 - 0.5 * camera.height) / camera.focal_px, 1.0);
  const Eigen::Vector3d from_camera = scene.recording.rotation(0, 1) * (ray * depth_m);
  const Eigen::Vector3d found = page.footprint[0] - page.local_from_camera->translation;
  EXPECT_NEAR(found.norm(), from_camera.norm(), 1e-4);
  EXPECT_LT((found - from_camera).norm(), 0.01 + 1e-4 * from_camera.norm());
  ASSERT_TRUE(page.overlap.has_value());
  EXPECT_GT(*page.overlap, 0.5);
  EXPECT_LT(*page.overlap, 1.0);
}

TEST(PageImage, OfAWideImageHoldsEveryNthPixel) {
  const test::ScratchFolder scratch;
  std::vector<test::SceneCamera> cameras = test::kitti_cameras();
  for (test::SceneCamera& camera : cameras) {
    camera.width = 1000;
    camera.height = 40;
  }
  const test::Recording recording = test::record_flight(cameras, 2);
  test::write_kitti(recording, scratch / "data");
  Findings findings;
  const Dataset dataset = read_dataset(scratch / "data", "", findings);
  const PageImage page = make_page_image(dataset, {0, 0, 0, {}}, 0);
  EXPECT_EQ(page.step, 3);
  EXPECT_EQ(page.width, 333);
  EXPECT_EQ(page.height, 13);
  for (int y = 0; y < page.height; ++y)
    for (int x = 0; x < page.width; x += 5)
      ASSERT_EQ(page.depth(x, y), static_cast<float>(recording.depth[0][0](3 * x + 1, 3 * y + 1)));
}

TEST(PageGround, ReliefAndCloudLieOnTheScenesGround) {
  const test::ScratchFolder scratch;
  const Scene scene(scratch / "data");
  const PageImage page = make_page_image(scene.dataset, {0, 0, 1, {}}, 0);
  const std::vector<const PageImage*> images = {&page};
  const Sequence& sequence = scene.dataset.sequences[0];
  const auto area = area_of(sequence, images);
  ASSERT_TRUE(area.has_value());
  for (const auto& pose : sequence.cameras[0].local_from_camera) {
    EXPECT_GT(pose->translation.x(), area->west_m);
    EXPECT_LT(pose->translation.x(), area->east_m);
    EXPECT_GT(pose->translation.y(), area->south_m);
    EXPECT_LT(pose->translation.y(), area->north_m);
  }
  const auto relief = relief_of(images, sequence, *area);
  ASSERT_TRUE(relief.has_value());
  EXPECT_EQ(relief->image.channels(), 4);
  EXPECT_LE(std::max(relief->image.width(), relief->image.height()), 640);
  for (const std::size_t most : {1000U, 100'000U}) {
    const core::Json cloud = cloud_of(images, sequence, most);
    EXPECT_LE(cloud.at("count").integer(), static_cast<std::int64_t>(most));
    EXPECT_GT(cloud.at("count").integer(), 500);
    const std::vector<float> xyz = unpacked<float, std::uint32_t>(cloud.at("positions"));
    const std::vector<double> origin = cloud.at("origin").numbers();
    const std::size_t count = xyz.size() / 3;
    ASSERT_EQ(count, static_cast<std::size_t>(cloud.at("count").integer()));
    // The sequence's frame is the scene's; float32 within a kilometre leaves 0.1 mm, poses of nine
    // digits less than a millimetre.
    for (std::size_t i = 0; i < count; ++i)
      ASSERT_NEAR(static_cast<double>(xyz[2 * count + i]) + origin[2],
                  scene.recording.height_m(static_cast<double>(xyz[i]) + origin[0],
                                           static_cast<double>(xyz[count + i]) + origin[1]),
                  2e-3);
  }
  EXPECT_FALSE(relief_of({}, sequence, *area).has_value());
}

TEST(PageFolder, IsTheSameForAnyThreadsAndHoldsNothingOfAnEarlierReport) {
  const test::ScratchFolder scratch;
  test::write_kitti(test::record_flight(test::kitti_cameras(), 3), scratch / "data",
                    {.one_disparity_counts = 8});
  const core::Log log("validate", core::LogLevel::Off);
  core::write_file(scratch / "2/page/images/9999.png", std::string_view("of an earlier report"));
  core::write_file(scratch / "1/page/images/notes.txt", std::string_view("somebody's own"));
  core::write_file(scratch / "2/page/images/notes.txt", std::string_view("somebody's own"));
  for (const int threads : {1, 2}) {
    core::Context context{log};
    context.num_threads = threads;
    run_validate_stage(scratch / "data", {}, scratch / std::to_string(threads), context);
  }
  EXPECT_EQ(test::first_difference(scratch / "1", scratch / "2"), "");
  EXPECT_EQ(core::read_text_file(scratch / "1/page/page.js"), page_script());
  // The check that fails says where, for people and for programs.
  const core::Json report = core::Json::read(scratch / "1/report.json");
  for (std::size_t i = 0; i < report.at("checks").size(); ++i) {
    const core::Json& check = report.at("checks").at(i);
    if (check.at("name").string() != "stereo_disparity") continue;
    EXPECT_FALSE(check.at("ok").boolean());
    EXPECT_EQ(check.at("place").at("camera").string(), "image_2");
    EXPECT_EQ(check.at("place").at("frame").integer(), 1);
    EXPECT_EQ(check.at("place").at("pixel").numbers(), (std::vector<double>{80.0, 64.0}));
  }
}

TEST(PageFolder, TakesAMapFromWhoKnowsTheGround) {
  const test::ScratchFolder scratch;
  const Scene scene(scratch / "data");
  MapArea asked;
  PageSource source{.dataset = &scene.dataset};
  source.ground_map = [&](const MapArea& area, int size_px) -> std::optional<core::Image8> {
    asked = area;
    return core::Image8(size_px, 10, 3);
  };
  write_report({}, {}, source, scratch / "report");
  EXPECT_NEAR(asked.lat_deg, scene.dataset.sequences[0].origin.lat_deg, 0.0);
  EXPECT_LT(asked.west_m, asked.east_m);
  const std::string data = core::read_text_file(scratch / "report/page/data.js");
  EXPECT_NE(data.find("\"source\":\"world\""), std::string::npos);
  source.ground_map = [](const MapArea&, int) { return std::nullopt; };
  write_report({}, {}, source, scratch / "report");
  EXPECT_NE(core::read_text_file(scratch / "report/page/data.js").find("\"source\":\"depth\""),
            std::string::npos);
}

}  // namespace
}  // namespace terracast::validate
