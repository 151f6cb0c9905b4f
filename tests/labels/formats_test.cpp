// COCO and KITTI object of rendered boxes: masks by an independent decoder, labels by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "capture/object_labels.h"
#include "capture/segments.h"
#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/log.h"
#include "core/random.h"
#include "core/semantic_class.h"
#include "core/toml_reader.h"
#include "export/coco_masks.h"
#include "export/exporter.h"
#include "tests/labels/boxes_world.h"
#include "tests/labels/coco_runs.h"
#include "tests/support/expect_error.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using core::SemanticClass;
using Eigen::Vector3d;

/// As objects_test.cpp has them, but that all of them are vehicles for KITTI.
const std::vector<WorldBox> kBoxes = {
    {.instance_id = 11,
     .semantic_class = SemanticClass::Truck,
     .low = {100, -5, 40},
     .high = {110, 5, 60}},
    {.instance_id = 12,
     .semantic_class = SemanticClass::Building,
     .low = {200, -20, 40},
     .high = {220, 0, 60}},
    {.instance_id = 13,
     .semantic_class = SemanticClass::Bus,
     .low = {100, -60, 45},
     .high = {100.0625, -40, 55}},
};
/// Heads north.
const WorldThing kThing{.instance_id = 70,
                        .place = {120.0, 30.0, 48.0},
                        .heading_rad = 0.5 * std::numbers::pi,
                        .scale = 2.0};

struct LabelFormats : testing::Test {
  ScratchFolder folder;

  capture::SequenceReader labelled(const render::SequencePlan& plan, const std::string& name) {
    const auto store = make_boxes_world(folder / ("world_" + name), kBoxes, {kThing});
    auto sequence = render_plan(store, plan, folder / name);
    make_labels(sequence, store, "objects");
    return sequence;
  }

  void run_export(const capture::SequenceReader& sequence, const std::string& toml,
                  const fs::path& out) {
    exporters::ExportOptions options;
    core::TomlDocument::parse(toml, "test.toml").read(options);
    const core::Log log("export", core::LogLevel::Off);
    exporters::run_export_stage({sequence}, {options}, out, {.log = log});
  }
};

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

std::vector<std::string> lines_of(const fs::path& file) {
  std::istringstream in(core::read_text_file(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(CocoRuns, ReadBackAsTheyWereByAnotherDecoder) {
  for (std::uint64_t trial = 0; trial < 200; ++trial) {
    std::vector<std::uint32_t> runs;
    std::vector<std::int64_t> truth;
    for (std::uint64_t i = 0; i < 1 + trial % 9; ++i) {
      const double exponent = core::random_between(0.0, 24.0, 9, trial, i);
      runs.push_back(static_cast<std::uint32_t>(std::exp2(exponent)) - (i == 0 ? 1 : 0));
      truth.push_back(runs.back());
    }
    EXPECT_EQ(runs_of_text(exporters::text_of_runs(runs)), truth);
  }
  // By hand from the description: 6 and 1 as they are, 40 in two groups, 1 - 1 = 0, 8 - 40 = -32 in two.
  const std::vector<std::uint32_t> runs = {6, 1, 40, 1, 8};
  EXPECT_EQ(exporters::text_of_runs(runs), "61X10PO");
}

TEST(CocoRuns, AreTheColumnsOfEachSegment) {
  core::ImageU32 numbers(23, 17);
  for (int y = 0; y < 17; ++y)
    for (int x = 0; x < 23; ++x)
      numbers(x, y) = static_cast<std::uint32_t>(
          4.0 * core::random_unit(3, 5, static_cast<std::uint64_t>(y / 3 * 23 + x / 4)));
  const auto segments = capture::segments_of(numbers);
  std::map<std::uint32_t, std::int64_t> areas;
  for (const std::uint32_t number : numbers.data()) ++areas[number];
  for (const auto& [number, segment] : segments) {
    EXPECT_EQ(segment.area, areas.at(number));
    const std::vector<bool> mask = mask_of_runs({segment.runs.begin(), segment.runs.end()});
    ASSERT_EQ(mask.size(), 23U * 17U);
    for (int y = 0; y < 17; ++y)
      for (int x = 0; x < 23; ++x)
        EXPECT_EQ(mask[static_cast<std::size_t>(x * 17 + y)], numbers(x, y) == number);
  }
  areas.erase(0);
  EXPECT_EQ(segments.size(), areas.size());
}

TEST_F(LabelFormats, CocoMasksAndBoxesAreThePixelsOfTheCapture) {
  render::SequencePlan plan = level_plan(2);
  const auto sequence = labelled(plan, "boxes");
  for (const std::string& categories : std::vector<std::string>{"coco", "own"}) {
    SCOPED_TRACE(categories);
    run_export(sequence, "format = \"coco\"\ncategories = \"" + categories + "\"\n",
               folder / ("out_" + categories));
    const fs::path root = folder / ("out_" + categories) / "coco";
    const Json instances = Json::read(root / "annotations/instances.json");
    std::map<std::int64_t, int> frame_of_image;
    for (std::size_t i = 0; i < instances.at("images").size(); ++i) {
      const Json& image = instances.at("images").at(i);
      frame_of_image[image.at("id").integer()] = static_cast<int>(image.at("frame").integer());
      EXPECT_EQ(image.at("width").integer(), 200);
      EXPECT_EQ(image.at("height").integer(), 160);
      EXPECT_TRUE(fs::exists(root / "images" / image.at("file_name").string()));
    }
    // In COCO's words a building is stuff.
    const std::map<std::int64_t, int> wanted =
        categories == "coco" ? std::map<std::int64_t, int>{{11, 8}, {13, 6}, {70, 3}}
                             : std::map<std::int64_t, int>{{11, 35}, {12, 26}, {13, 36}, {70, 33}};
    const Json& annotations = instances.at("annotations");
    EXPECT_EQ(annotations.size(), 2 * wanted.size());
    for (std::size_t i = 0; i < annotations.size(); ++i) {
      const Json& one = annotations.at(i);
      EXPECT_EQ(one.at("id").integer(), static_cast<std::int64_t>(i) + 1);
      EXPECT_EQ(one.at("iscrowd").integer(), 0);
      const std::int64_t id = one.at("instance_id").integer();
      EXPECT_EQ(one.at("category_id").integer(), wanted.at(id));
      const auto facts = sequence.read_camera(frame_of_image.at(one.at("image_id").integer()), 0,
                                              capture::SequenceReader::kFacts);
      const std::vector<bool> mask =
          mask_of_runs(runs_of_text(one.at("segmentation").at("counts").string()));
      ASSERT_EQ(mask.size(), 200U * 160U);
      EXPECT_EQ(one.at("segmentation").at("size").numbers(), (std::vector<double>{160, 200}));
      std::int64_t area = 0;
      Eigen::AlignedBox2d box;
      for (int y = 0; y < 160; ++y)
        for (int x = 0; x < 200; ++x) {
          const bool is_shown = facts.instance_id(x, y) == id;
          ASSERT_EQ(mask[static_cast<std::size_t>(x * 160 + y)], is_shown);
          if (!is_shown) continue;
          ++area;
          box.extend(Eigen::Vector2d(x, y));
          box.extend(Eigen::Vector2d(x + 1, y + 1));
        }
      EXPECT_EQ(one.at("area").integer(), area);
      EXPECT_EQ(one.at("bbox").numbers(), (std::vector<double>{box.min().x(), box.min().y(),
                                                               box.sizes().x(), box.sizes().y()}));
    }
  }
}

// Every pixel's number is a segment of its category, and the reverse: panopticapi's rule.
TEST_F(LabelFormats, CocoPanopticImagesHoldTheirSegmentsAndNothingElse) {
  const auto sequence = labelled(level_plan(2), "boxes");
  for (const std::string& categories : std::vector<std::string>{"coco", "own"}) {
    SCOPED_TRACE(categories);
    run_export(sequence, "format = \"coco\"\ncategories = \"" + categories + "\"\n",
               folder / ("out_" + categories));
    const fs::path root = folder / ("out_" + categories) / "coco";
    const Json panoptic = Json::read(root / "annotations/panoptic.json");
    std::map<std::int64_t, bool> is_thing;
    for (std::size_t i = 0; i < panoptic.at("categories").size(); ++i) {
      const Json& category = panoptic.at("categories").at(i);
      is_thing[category.at("id").integer()] = category.at("isthing").integer() == 1;
      EXPECT_EQ(category.at("color").size(), 3U);
    }
    std::map<std::int64_t, std::int64_t> thing_of_instance;
    ASSERT_EQ(panoptic.at("annotations").size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      const Json& one = panoptic.at("annotations").at(i);
      const auto png = std::get<core::Image8>(core::decode_png(
          core::read_file(root / "panoptic" / one.at("file_name").string()), "png"));
      const auto facts =
          sequence.read_camera(static_cast<int>(i), 0, capture::SequenceReader::kFacts);
      std::map<std::int64_t, std::int64_t> counted;
      std::map<std::int64_t, const Json*> listed;
      for (std::size_t k = 0; k < one.at("segments_info").size(); ++k) {
        const Json& segment = one.at("segments_info").at(k);
        EXPECT_TRUE(listed.emplace(segment.at("id").integer(), &segment).second);
      }
      for (int y = 0; y < 160; ++y)
        for (int x = 0; x < 200; ++x) {
          const std::int64_t number = png(x, y, 0) + 256 * png(x, y, 1) + 65536 * png(x, y, 2);
          const std::uint32_t instance = facts.instance_id(x, y);
          const auto& info = core::semantic_classes()[facts.semantic_id(x, y)];
          const int category = categories == "coco" ? info.coco_id : static_cast<int>(info.id) + 1;
          if (category == 0) {
            ASSERT_EQ(number, 0);
            continue;
          }
          ++counted[number];
          ASSERT_TRUE(listed.contains(number));
          ASSERT_EQ(listed.at(number)->at("category_id").integer(), category);
          if (instance == 0 || !is_thing.at(category)) {
            ASSERT_EQ(number, category);
            continue;
          }
          // One number for an instance in both frames.
          const auto known = thing_of_instance.emplace(instance, number);
          ASSERT_EQ(known.first->second, number);
          ASSERT_GE(number, 1000);
        }
      ASSERT_EQ(counted.size(), listed.size());
      for (const auto& [number, segment] : listed)
        EXPECT_EQ(segment->at("area").integer(), counted.at(number));
    }
    EXPECT_EQ(thing_of_instance.size(), categories == "coco" ? 3U : 4U);
  }
}

// Asked where it is installed: python3 with Debian's or PyPI's pycocotools.
TEST_F(LabelFormats, CocoIsReadByItsOwnTools) {
  const std::string python = "python3";
  if (run_command(python, {"-c", "import pycocotools.coco"}).status != 0)
    GTEST_SKIP() << "python3 has no pycocotools";
  const auto sequence = labelled(level_plan(1), "boxes");
  run_export(sequence, "format = \"coco\"\n", folder / "out");
  const std::string script =
      "import sys\nfrom pycocotools.coco import COCO\n"
      "coco = COCO(sys.argv[1])\n"
      "for a in coco.loadAnns(coco.getAnnIds()):\n"
      "  m = coco.annToMask(a)\n"
      "  print('mask', a['instance_id'], m.shape[0], m.shape[1], int(m.sum()), int(a['area']))\n";
  const auto ran = run_command(
      python, {"-c", script, (folder / "out/coco/annotations/instances.json").string()});
  ASSERT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, testing::HasSubstr("mask 11 160 200 800 800"));
}

// Frame 0 looks level along x from (0, 0, 50). In KITTI's camera x is -y of the world, y 50 - z, z is x.
TEST_F(LabelFormats, KittiLabelsAreThoseOfTheHandComputation) {
  const auto sequence = labelled(level_plan(1), "boxes");
  run_export(sequence, "format = \"kitti_object\"\n", folder / "out");
  const fs::path root = folder / "out" / "kitti_object" / "training";
  std::map<std::string, std::vector<std::string>> rows;
  for (const std::string& line : lines_of(root / "label_2/000000.txt")) {
    const auto words = words_of(line);
    ASSERT_EQ(words.size(), 15U) << line;
    EXPECT_EQ(line.find("  "), std::string::npos);
    rows[words[0]] = words;
  }
  ASSERT_EQ(rows.size(), 3U);  // a building is none of KITTI's
  const auto number = [&](const char* type, std::size_t i) {
    return std::stod(rows.at(type).at(i));
  };
  const auto expect_row = [&](const char* type, std::vector<double> truth, double tolerance) {
    SCOPED_TRACE(type);
    for (std::size_t i = 0; i < truth.size(); ++i)
      EXPECT_NEAR(number(type, i + 1), truth[i], tolerance) << "field " << i + 1;
  };
  // Up leans by 2e-5 over these 120 m, and corners lie on a lattice of 1 mm.
  constexpr double kTolerance = 6e-3;
  // A box of 10 x 10 x 20 m, its foot 10 m below the camera, 105 m ahead: which way it faces is not said.
  {
    const double turn = number("Truck", 14);
    EXPECT_NEAR(std::abs(std::sin(2.0 * turn)), 0.0, 1e-3);
    expect_row("Truck",
               {0.0, 0.0, turn, 89.5, 59.5, 109.5, 99.5, 20.0, 10.0, 10.0, 0.0, 10.0, 105.0},
               kTolerance);
  }
  // The cart is 3 x 4 x 8 m and heads north: to the left of the camera, -x, which is a turn of pi about y, down. Its
  // middle lies 2 m before its place.
  {
    const double alpha =
        std::remainder(std::numbers::pi - std::atan2(-32.0, 120.0), 2 * std::numbers::pi);
    // Its near side stands 2 m before its place and reaches from y = 28 to 36, its roof 3 m above it.
    const double left = 100.0 - 200.0 * 36.0 / 118.0 - 0.5,
                 right = 100.0 - 200.0 * 28.0 / 122.0 - 0.5;
    const double top = 80.0 - 200.0 * 1.0 / 118.0 - 0.5, bottom = 80.0 + 200.0 * 2.0 / 118.0 - 0.5;
    expect_row("Car", {0.0, 0.0, alpha, left, top, right, bottom, 3.0, 4.0, 8.0, -32.0, 2.0, 120.0},
               kTolerance);
    EXPECT_NEAR(std::abs(number("Car", 14)), std::numbers::pi, 1e-4);
  }
  // Half outside: KITTI's box ends at the image's last column.
  EXPECT_EQ(number("Misc", 6), 199.0);
  // By its solid angle: of the rectangle from y = -40 to -60, 10 m high, at 100 m.
  const auto angle = [](double a) {
    return std::atan(5.0 * a / (100.0 * std::hypot(a, 5.0, 100.0)));
  };
  EXPECT_NEAR(number("Misc", 1), (angle(60) - angle(50)) / (angle(60) - angle(40)), 1.0 / 128.0);

  // A level camera needs no turning: the frame of the boxes is the camera's.
  std::map<std::string, std::vector<double>> calib;
  for (const std::string& line : lines_of(root / "calib/000000.txt")) {
    const auto words = words_of(line);
    for (std::size_t i = 1; i < words.size(); ++i) calib[words[0]].push_back(std::stod(words[i]));
  }
  const std::vector<double> k = {200, 0, 99.5, 0, 0, 200, 79.5, 0, 0, 0, 1, 0};
  for (const char* name : {"P0:", "P1:", "P2:", "P3:"})
    for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(calib.at(name).at(i), k[i], 1e-3);
  for (std::size_t i = 0; i < 9; ++i)
    EXPECT_NEAR(calib.at("R0_rect:").at(i), i % 4 == 0 ? 1.0 : 0.0, 1e-5);
}

/// Corners of a label as KITTI's own tools make them: a box of length along x and width along z about its foot,
/// turned about y.
std::vector<Vector3d> kitti_corners(const std::vector<std::string>& words) {
  const auto number = [&](std::size_t i) { return std::stod(words.at(i)); };
  const double h = number(8), w = number(9), l = number(10), turn = number(14);
  std::vector<Vector3d> corners;
  for (const double x : {-0.5 * l, 0.5 * l})
    for (const double y : {0.0, -h})
      for (const double z : {-0.5 * w, 0.5 * w})
        corners.emplace_back(std::cos(turn) * x + std::sin(turn) * z + number(11), y + number(12),
                             -std::sin(turn) * x + std::cos(turn) * z + number(13));
  return corners;
}

// A camera that is pitched and banked: what P2 makes of the corners of a label's box is where the object is seen.
TEST_F(LabelFormats, KittiBoxesOfATiltedCameraProjectToTheirImages) {
  render::SequencePlan plan = level_plan(1);
  plan.states[0].world_from_body.translation = {20.0, 10.0, 75.0};
  plan.states[0].world_from_body.rotation = Eigen::AngleAxisd(-0.15, Vector3d::UnitZ()) *
                                            Eigen::AngleAxisd(0.35, Vector3d::UnitY()) *
                                            Eigen::AngleAxisd(0.2, Vector3d::UnitX());
  const auto sequence = labelled(plan, "boxes");
  run_export(sequence, "format = \"kitti_object\"\n", folder / "out");
  const fs::path root = folder / "out" / "kitti_object" / "training";
  Eigen::Matrix<double, 3, 4> p2;
  Eigen::Matrix3d rect;
  for (const std::string& line : lines_of(root / "calib/000000.txt")) {
    const auto words = words_of(line);
    if (words[0] == "P2:")
      for (int i = 0; i < 12; ++i) p2(i / 4, i % 4) = std::stod(words.at(1 + i));
    if (words[0] == "R0_rect:")
      for (int i = 0; i < 9; ++i) rect(i / 3, i % 3) = std::stod(words.at(1 + i));
  }
  // x = P2 R0_rect X of a point before the camera is where a pinhole sees it.
  const Vector3d point(1.0, -2.0, 10.0);
  const Vector3d image = p2 * (rect * point).homogeneous();
  EXPECT_NEAR(image.x() / image.z(), 99.5 + 20.0, 1e-9);
  EXPECT_NEAR(image.y() / image.z(), 79.5 - 40.0, 1e-9);
  EXPECT_NEAR(rect.determinant(), 1.0, 1e-9);
  int num_rows = 0;
  for (const std::string& line : lines_of(root / "label_2/000000.txt")) {
    const auto words = words_of(line);
    if (words[0] == "Misc") continue;  // leaves the image
    ++num_rows;
    Eigen::AlignedBox2d box;
    for (const Vector3d& corner : kitti_corners(words))
      box.extend((p2 * corner.homogeneous()).hnormalized().head<2>());
    // Both of them are boxes, so that theirs is the object's own box but for what 4 decimals leave.
    constexpr double kTolerance_px = 0.01;
    EXPECT_NEAR(box.min().x(), std::stod(words[4]), kTolerance_px) << line;
    EXPECT_NEAR(box.min().y(), std::stod(words[5]), kTolerance_px) << line;
    EXPECT_NEAR(box.max().x(), std::stod(words[6]), kTolerance_px) << line;
    EXPECT_NEAR(box.max().y(), std::stod(words[7]), kTolerance_px) << line;
  }
  EXPECT_EQ(num_rows, 2);
  const Json dataset = Json::read(folder / "out" / "kitti_object" / "dataset.json");
  EXPECT_LT(dataset.at("largest_tilt_deg").number(), 0.01);
}

TEST_F(LabelFormats, SmallObjectsAreDontCare) {
  const auto sequence = labelled(level_plan(1), "boxes");
  run_export(sequence, "format = \"kitti_object\"\nmin_height_px = 10\n", folder / "out");
  const auto lines = lines_of(folder / "out/kitti_object/training/label_2/000000.txt");
  ASSERT_EQ(lines.size(), 3U);
  int num_dont_care = 0;
  for (const std::string& line : lines)
    if (line.starts_with("DontCare -1 -1 -10 ")) {
      ++num_dont_care;
      EXPECT_TRUE(line.ends_with(" -1 -1 -1 -1000 -1000 -1000 -10"));
    }
  EXPECT_EQ(num_dont_care, 1);
}

TEST_F(LabelFormats, WithoutLabelsNothingIsWritten) {
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, level_plan(), folder / "boxes");
  for (const std::string& format : std::vector<std::string>{"coco", "kitti_object"}) {
    expect_error(ErrorKind::Input, {"terracast label", "exporting " + format},
                 [&] { run_export(sequence, "format = \"" + format + "\"\n", folder / "out"); });
    EXPECT_FALSE(fs::exists(folder / "out" / format / "dataset.json"));
  }
}

}  // namespace
}  // namespace terracast::test
