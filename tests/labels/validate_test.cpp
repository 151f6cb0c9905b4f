// Right datasets of COCO and KITTI object pass `validate`; each kind of mistake in their files is found and named.

#include <gtest/gtest.h>

#include <functional>

#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/log.h"
#include "core/toml_reader.h"
#include "export/exporter.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_capture.h"
#include "validate/check.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;

struct LabelledDatasets : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;

  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    // A wall that is a truck, seen by four small cameras in two sequences.
    write_tiny_capture(*folder / "capture", {.num_frames = 2, .has_tartan2 = false});
    write_tiny_capture(*folder / "capture",
                       {.name = "ridge", .num_frames = 3, .has_tartan2 = false});
    for (const char* toml : {"format = \"coco\"\ncategories = \"own\"\n",
                             "format = \"kitti_object\"\ncamera = \"cam0\"\n"}) {
      exporters::ExportOptions options;
      core::TomlDocument::parse(toml, "test.toml").read(options);
      std::vector<capture::SequenceReader> sequences;
      for (const fs::path& each : capture::list_sequences(*folder / "capture"))
        sequences.push_back(capture::SequenceReader::open(each));
      const core::Log log("export", core::LogLevel::Off);
      exporters::run_export_stage(sequences, {options}, *folder / "right", {.log = log});
    }
  }
  static void TearDownTestSuite() { folder.reset(); }

  /// The check of the files; all others must hold.
  static validate::CheckResult structure_of(const fs::path& dataset) {
    const core::Log log("validate", core::LogLevel::Off);
    validate::CheckResult structure;
    for (validate::CheckResult& result :
         validate::run_validate_stage(dataset, {}, *folder / "report", {.log = log})) {
      if (result.name == "structure")
        structure = std::move(result);
      else
        EXPECT_TRUE(result.ok) << result.name << ": " << result.worst;
    }
    return structure;
  }

  /// Changes a file of a copy of a dataset, and what dataset.json says of it, as an exporter that is wrong would.
  static void expect_found(const std::string& format, const std::string& path,
                           const std::function<void(std::string&)>& spoil,
                           const std::vector<std::string>& words) {
    const fs::path copy = *folder / "spoiled";
    fs::remove_all(copy);
    fs::copy(*folder / "right" / format, copy, fs::copy_options::recursive);
    std::string text = core::read_text_file(copy / path);
    const std::string before = text;
    spoil(text);
    ASSERT_NE(text, before);
    core::write_file(copy / path, text);
    const Json right = Json::read(copy / "dataset.json");
    Json dataset = Json::object();
    for (const auto& [member, value] : right.members()) {
      if (member != "files") {
        dataset.set(member, value);
        continue;
      }
      Json files = Json::object();
      for (const auto& [file, record] : value.members())
        files.set(file, file == path ? Json::object()
                                           .set("bytes", static_cast<std::uint64_t>(text.size()))
                                           .set("xxh3_128", core::content_hash(text))
                                     : record);
      dataset.set("files", std::move(files));
    }
    dataset.write(copy / "dataset.json");
    const validate::CheckResult structure = structure_of(copy);
    EXPECT_FALSE(structure.ok);
    for (const std::string& word : words) EXPECT_THAT(structure.worst, testing::HasSubstr(word));
  }
};

std::function<void(std::string&)> replaced(const std::string& from, const std::string& to) {
  return [=](std::string& text) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  };
}

/// A field of the first row, counted from 0.
std::function<void(std::string&)> with_field(std::size_t field, const std::string& value) {
  return [=](std::string& text) {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < field; ++i) begin = text.find(' ', begin) + 1;
    text.replace(begin, text.find_first_of(" \n", begin) - begin, value);
  };
}

TEST_F(LabelledDatasets, RightOnesPass) {
  for (const char* format : {"coco", "kitti_object"}) {
    SCOPED_TRACE(format);
    const validate::CheckResult structure = structure_of(*folder / "right" / format);
    EXPECT_TRUE(structure.ok) << structure.worst;
  }
}

TEST_F(LabelledDatasets, MistakesOfCocoAreNamed) {
  const std::string instances = "annotations/instances.json",
                    panoptic = "annotations/panoptic.json";
  expect_found("coco", instances, replaced("\"area\":", "\"area\":1"), {"annotation 1", "area"});
  expect_found("coco", instances, replaced("\"bbox\":[", "\"bbox\":[1"), {"annotation 1", "bbox"});
  expect_found("coco", instances, replaced("\"counts\":\"", "\"counts\":\"1"),
               {"annotation 1", "runs"});
  expect_found("coco", instances, replaced("\"counts\":\"", "\"counts\":\"~"),
               {"annotation 1", "no text of runs"});
  expect_found("coco", instances, replaced("\"category_id\":35", "\"category_id\":36"),
               {"annotation 1", "category 36"});
  expect_found("coco", instances, replaced("{\"id\": 2,", "{\"id\": 1,"), {"stands twice"});
  expect_found("coco", panoptic, replaced("\"area\":", "\"area\":1"), {"segment 0", "area"});
  expect_found("coco", panoptic, replaced("\"id\":1000", "\"id\":1001"), {"1001"});
  expect_found("coco", panoptic, replaced("\"segments_info\":[{", "\"segments_info\":[],\"x\":[{"),
               {"is not listed"});
  expect_found("coco", "panoptic/ridge/mcs4_cam0/000001.png",
               [](std::string& png) {
                 auto image = std::get<core::Image8>(
                     core::decode_png(std::as_bytes(std::span(png)), "panoptic"));
                 image(44, 40, 0) ^= 1U;
                 const auto bytes = core::encode_png(image);
                 png.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
               },
               {"mcs4_cam0/000001.png"});
}

TEST_F(LabelledDatasets, MistakesOfKittiObjectAreNamed) {
  const std::string label = "training/label_2/000000.txt", calib = "training/calib/000000.txt";
  const auto expect_label = [&](std::size_t field, const std::string& value,
                                const std::string& word) {
    expect_found("kitti_object", label, with_field(field, value), {"label_2/000000.txt:1", word});
  };
  expect_label(0, "Lorry", "none of KITTI's");
  expect_label(1, "1.5", "truncated");
  expect_label(2, "4", "occluded");
  expect_label(3, "0.5", "alpha");
  expect_label(4, "-3.0", "leaves the image");
  expect_label(8, "2.0", "beyond the projection");      // height
  expect_label(10, "2.0", "beyond the projection");     // length
  expect_label(12, "-200.0", "beyond the projection");  // down: y is not up
  expect_label(14, "x", "x");
  expect_found("kitti_object", label, replaced(" ", "  "), {"single blanks"});
  expect_found("kitti_object", calib, replaced("R0_rect: ", "R0_rect: 1"), {"no rotation"});
  expect_found("kitti_object", calib, replaced("R0_rect", "R_rect"), {"none of the format's keys"});
  expect_found("kitti_object", calib, replaced("P2: ", "P2: 1"), {"P0 is not P2"});
  expect_found("kitti_object", calib,
               [](std::string& text) {
                 for (const char* matrix : {"P0: ", "P1: ", "P2: ", "P3: "})
                   replaced(matrix, std::string(matrix) + "1")(text);
               },
               {"calib/000000.txt", "camera matrix"});
}

}  // namespace
}  // namespace terracast::test
