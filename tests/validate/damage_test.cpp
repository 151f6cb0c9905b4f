#include <gtest/gtest.h>
#include <zip.h>

#include <fstream>
#include <functional>
#include <map>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/log.h"
#include "tests/support/folder_compare.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/check.h"
#include "validate/npy.h"

/// Damage of every kind is a failed check that names the file; never a crash, and never an error
/// that ends the run.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

const test::Recording& small_flight(const std::string& format) {
  static const test::Recording kitti = test::record_flight(test::kitti_cameras(), 3);
  static const test::Recording colmap = test::record_flight(test::colmap_cameras(), 3);
  static const test::Recording raw = test::record_smooth_flight(test::kitti_raw_cameras(), 3);
  return format == "kitti" ? kitti : format == "kitti_raw" ? raw : colmap;
}

/// Of TartanAir's size, of one colour and one depth: enough for damage.
test::Recording blank_flight(double baseline_m, bool is_v1 = false) {
  test::Recording recording;
  recording.cameras = is_v1 ? test::tartanair_v1_cameras() : test::tartanair_cameras();
  recording.cameras[1].offset_body *= baseline_m / 0.25;
  for (int frame = 0; frame < 3; ++frame) {
    recording.body_world.emplace_back(frame, 0.0, 100.0);
    recording.world_from_body.push_back(Eigen::Matrix3d::Identity());
  }
  const int height = recording.cameras[0].height;
  recording.color.assign(2, {3, core::Image8(640, height, 3, 100)});
  recording.depth.assign(2, {3, core::Image<double>(640, height, 1, 80.0)});
  return recording;
}

std::vector<CheckResult> run(const fs::path& folder, const fs::path& report) {
  const core::Log log("validate", core::LogLevel::Off);
  ValidateOptions options;
  options.samples_per_image = 100;
  return run_validate_stage(folder, options, report, {log});
}

CheckResult structure_of(const std::vector<CheckResult>& results) {
  for (const CheckResult& result : results)
    if (result.name == "structure") return result;
  return {};
}

void write(const std::string& format, const fs::path& folder) {
  if (format == "kitti")
    test::write_kitti(small_flight(format), folder);
  else if (format == "kitti_raw")
    test::write_kitti_raw(small_flight(format), folder);
  else if (format == "tartanair")
    test::write_tartanair(blank_flight(0.25), folder);
  else if (format == "tartanair_v1")
    test::write_tartanair_v1(blank_flight(0.25, true), folder);
  else
    test::write_colmap(small_flight(format), folder);
}

void truncate(const fs::path& file) { fs::resize_file(file, fs::file_size(file) / 2); }
void flip_bit(const fs::path& file) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  const auto at = static_cast<std::streamoff>(fs::file_size(file) / 2);
  stream.seekg(at);
  const int byte = stream.get();
  stream.seekp(at);
  stream.put(static_cast<char>(byte ^ 4));
}
void replace(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = core::read_text_file(file);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos);
  core::write_file(file, text.replace(at, from.size(), to));
}

/// Puts a mask where the flow should be.
void swap_flow_for_mask(const fs::path& file) {
  zip_t* archive = zip_open(file.c_str(), 0, nullptr);
  const auto index_of = [&](const char* name) {
    return static_cast<zip_uint64_t>(zip_name_locate(archive, name, 0));
  };
  zip_delete(archive, index_of("flow_fwd.npy"));
  zip_file_rename(archive, index_of("fov_mask_fwd.npy"), "flow_fwd.npy", 0);
  ASSERT_EQ(zip_close(archive), 0);
}
/// Writes an image of 640 x 640 pixels of `value`, with one pixel of another.
void write_image(const fs::path& file, int channels, std::uint8_t value, std::uint8_t other) {
  core::Image8 image(640, 640, channels, value);
  for (int k = 0; k < channels; ++k) image(5, 7, k) = other;
  core::write_file(file, core::encode_png(image));
}

void write_last_byte(const fs::path& file, char value) {
  std::string bytes = core::read_text_file(file);
  bytes.back() = value;
  core::write_file(file, bytes);
}

struct Damage {
  std::string name;
  std::string format;
  std::function<void(const fs::path&)> hurt;
  std::string named;  ///< what the finding must name
  bool list_again =
      false;  ///< dataset.json then lists the damaged files as they are: only reading them can tell
};

void PrintTo(const Damage& one, std::ostream* out) { *out << one.named; }

class Damaged : public testing::TestWithParam<Damage> {};

TEST_P(Damaged, IsAFindingThatNamesTheFile) {
  const test::ScratchFolder scratch;
  write(GetParam().format, scratch / "data");
  GetParam().hurt(scratch / "data");
  if (GetParam().list_again) test::list_files_again(scratch / "data");
  const std::vector<CheckResult> results = run(scratch / "data", scratch / "report");
  const CheckResult structure = structure_of(results);
  EXPECT_FALSE(structure.ok);
  for (const CheckResult& result : results) EXPECT_EQ(result.worst.find('\xff'), std::string::npos);
  EXPECT_NE(structure.worst.find(GetParam().named), std::string::npos) << structure.worst;
  EXPECT_FALSE(core::Json::read(scratch / "report/report.json").at("ok").boolean());
}

const std::string kKitti = "dataset/sequences/00/";
const std::string kDate = "2024_06_21/";
const std::string kDrive = kDate + "2024_06_21_drive_0005_sync/";
const std::string kSparse = "flight/sparse/0/";
const std::string kTartanAir = "Hills/Data_easy/P000/";
const std::string kTartanAirV1 = "Hills/Easy/P000/";
const std::string kFlow = kTartanAir + "flow_lcam_front/000000_000001_lcam_front_flow.npz";

const Damage kDamages[] = {
    {"MissingImage", "kitti",
     [](const fs::path& d) { fs::remove(d / kKitti / "image_2/000001.png"); },
     "image_2/000001.png"},
    {"MissingImageUnlisted", "kitti",
     [](const fs::path& d) { fs::remove(d / kKitti / "image_2/000001.png"); },
     "image_2/000001.png: missing", true},
    {"FlippedBit", "kitti", [](const fs::path& d) { flip_bit(d / kKitti / "depth_2/000002.npy"); },
     "depth_2/000002.npy"},
    {"ExtraFile", "kitti",
     [](const fs::path& d) { core::write_file(d / kKitti / "notes.txt", std::string_view("x")); },
     "notes.txt: not listed"},
    {"ExtraFileOfNoUtf8", "kitti",
     [](const fs::path& d) { core::write_file(d / kKitti / "bad\xff.png", std::string_view("x")); },
     "bad\\xff.png: not listed"},
    {"ExtraFileOfTwoLines", "kitti",
     [](const fs::path& d) {
       core::write_file(d / kKitti / "two\nlines.png", std::string_view("x"));
     },
     "two\\x0alines.png: not listed"},
    {"GeoreferenceCameraOfNoUtf8", "kitti",
     [](const fs::path& d) {
       replace(d / kKitti / "georeference.csv", ",image_2,", ",image_\xff,");
     },
     "camera \"image_\\xff\" is not in the dataset", true},
    {"GeoreferenceCameraCutWithinALetter", "kitti",
     [](const fs::path& d) {
       replace(d / kKitti / "georeference.csv", ",image_2,",
               "," + std::string(59, 'a') + "\xc3\xa9,");
     },
     std::string(59, 'a') + "\" is not in the dataset", true},
    {"ExtraImage", "kitti",
     [](const fs::path& d) {
       fs::copy_file(d / kKitti / "image_2/000001.png", d / kKitti / "image_2/000007.png");
     },
     "1 files that are not", true},
    {"TruncatedPng", "kitti",
     [](const fs::path& d) { truncate(d / kKitti / "image_3/000002.png"); }, "image_3/000002.png",
     true},
    {"TruncatedNpy", "kitti",
     [](const fs::path& d) { truncate(d / kKitti / "depth_2/000000.npy"); },
     "bytes of values where", true},
    {"HugeNpy", "kitti",
     [](const fs::path& d) {
       replace(d / kKitti / "depth_2/000000.npy", "(128, 160, ), }    ", "(9999999999999, 9), }");
     },
     "too large", true},
    {"SwappedSides", "kitti",
     [](const fs::path& d) {
       replace(d / kKitti / "depth_2/000000.npy", "(128, 160", "(160, 128");
     },
     "128 x 160 pixels where 160 x 128", true},
    {"MissingPoseRow", "kitti",
     [](const fs::path& d) {
       std::string t = core::read_text_file(d / "dataset/poses/00.txt");
       t.erase(0, t.find('\n') + 1);
       core::write_file(d / "dataset/poses/00.txt", t);
     },
     "2 rows for 3 frames", true},
    {"GarbagePose", "kitti",
     [](const fs::path& d) { replace(d / "dataset/poses/00.txt", " 0 ", " nan "); },
     "is not a finite number", true},
    {"MissingCalibrationLine", "kitti",
     [](const fs::path& d) { replace(d / kKitti / "calib.txt", "Tr:", "Xy:"); },
     "no line Tr:", true},
    {"MissingTimes", "kitti", [](const fs::path& d) { fs::remove(d / kKitti / "times.txt"); },
     "times.txt", true},
    {"DisparityOf8Bits", "kitti",
     [](const fs::path& d) {
       fs::copy_file(d / kKitti / "image_2/000000.png", d / kKitti / "disp_2/000000.png",
                     fs::copy_options::overwrite_existing);
     },
     "16 bits", true},
    {"HugeFrameCount", "kitti",
     [](const fs::path& d) {
       replace(d / "dataset.json", "\"num_frames\": 3", "\"num_frames\": 300000000000");
     },
     "num_frames"},
    {"MoreFramesThanFiles", "kitti",
     [](const fs::path& d) {
       replace(d / "dataset.json", "\"num_frames\": 3", "\"num_frames\": 1000000");
     },
     "dataset.json: sequences: num_frames = 1000000 of 2 cameras in \"00\" makes 2000000 images"},
    {"MoreSequencesThanFiles", "kitti",
     [](const fs::path& d) {
       core::Json json = core::Json::read(d / "dataset.json");
       core::Json sequences = json.at("sequences");
       for (int i = 0; i < 2; ++i) sequences.push(json.at("sequences").at(std::size_t{0}));
       json.set("sequences", sequences).write(d / "dataset.json");
     },
     "makes 18 images so far, but \"files\" lists 16 files"},
    {"PathOutside", "kitti",
     [](const fs::path& d) {
       replace(d / "dataset.json", "\"path\": \"dataset", "\"path\": \"../../etc");
     },
     "leaves the dataset"},
    {"NoSequences", "kitti",
     [](const fs::path& d) { replace(d / "dataset.json", "\"sequences\"", "\"sequencez\""); },
     "dataset.json"},
    {"GeoreferenceGarbage", "kitti",
     [](const fs::path& d) {
       replace(d / kKitti / "georeference.csv", "image_2,0,42.", "image_2,0,942.");
     },
     "is no place", true},
    {"MissingPacket", "kitti_raw",
     [](const fs::path& d) { fs::remove(d / kDrive / "oxts/data/0000000001.txt"); },
     "oxts/data/0000000001.txt: missing", true},
    {"PacketOf29Numbers", "kitti_raw",
     [](const fs::path& d) {
       replace(d / kDrive / "oxts/data/0000000001.txt", " 0.000001000 ", " ");
     },
     "29 numbers where 30 should be", true},
    {"PacketNowhere", "kitti_raw",
     [](const fs::path& d) { replace(d / kDrive / "oxts/data/0000000002.txt", "42.", "942."); },
     "is no place", true},
    {"TimesOfEightDecimals", "kitti_raw",
     [](const fs::path& d) { replace(d / kDrive / "oxts/timestamps.txt", "000\n", "00\n"); },
     "a time stamp of 28 characters", true},
    {"TimesWithoutTheLastLinesEnd", "kitti_raw",
     [](const fs::path& d) {
       std::string t = core::read_text_file(d / kDrive / "oxts/timestamps.txt");
       t.pop_back();
       core::write_file(d / kDrive / "oxts/timestamps.txt", t);
     },
     "no new line at its end", true},
    {"TimeThatIsNone", "kitti_raw",
     [](const fs::path& d) { replace(d / kDrive / "oxts/timestamps.txt", "06-21", "06-31"); },
     "is no time like", true},
    {"CamerasOtherTimes", "kitti_raw",
     [](const fs::path& d) { replace(d / kDrive / "image_03/timestamps.txt", "000\n", "001\n"); },
     "other times than oxts/timestamps.txt", true},
    {"MissingKey", "kitti_raw",
     [](const fs::path& d) {
       replace(d / kDate / "calib_cam_to_cam.txt", "R_rect_00", "R_rekt_00");
     },
     "no line R_rect_00:", true},
    {"RectifiedFromAnotherCamera", "kitti_raw",
     [](const fs::path& d) {
       replace(d / kDate / "calib_cam_to_cam.txt", "T_03: -0.5", "T_03: -0.6");
     },
     "T_03 and R_rect_03 are not those", true},
    {"DriveOfAnotherDate", "kitti_raw",
     [](const fs::path& d) {
       replace(d / "dataset.json", "\"2024_06_21_drive", "\"2024_06_22_drive");
     },
     "the path of sequence 2024_06_22_drive_0005_sync ends otherwise"},
    {"TruncatedPoints", "colmap", [](const fs::path& d) { truncate(d / kSparse / "points3D.bin"); },
     "points3D.bin", true},
    {"TruncatedImages", "colmap", [](const fs::path& d) { truncate(d / kSparse / "images.bin"); },
     "images.bin", true},
    {"HugeCount", "colmap",
     [](const fs::path& d) {
       std::fstream f(d / kSparse / "points3D.bin",
                      std::ios::in | std::ios::out | std::ios::binary);
       const std::uint64_t n = ~std::uint64_t{0} / 2;
       f.write(reinterpret_cast<const char*>(&n), 8);
     },
     "more than the file can hold", true},
    {"NameOfNoUtf8", "colmap",
     [](const fs::path& d) {
       replace(d / kSparse / "images.bin", "rig/cam0/000000.png", "rig/cam\xff/000000.png");
       truncate(d / kSparse / "frames.bin");
     },
     "image \"rig/cam\\xff/000000.png\" belongs to no camera", true},
    {"LongNameCutWithinALetter", "colmap",
     [](const fs::path& d) {
       replace(d / kSparse / "images.bin", "rig/cam0/000000.png",
               std::string(99, 'a') + "\xc3\xa9.png");
     },
     std::string(99, 'a') + "\" belongs to no camera", true},
    {"NoRigs", "colmap", [](const fs::path& d) { fs::remove(d / kSparse / "rigs.bin"); },
     "rigs.bin", true},
    {"NoLineOfPoints", "colmap",
     [](const fs::path& d) {
       core::write_file(d / "flight/sparse_txt/0/images.txt",
                        std::string_view("1 1 0 0 0 0 0 0 1 rig/cam0/000000.png\n"));
     },
     "no line of points", true},
    {"EmptyFiles", "colmap",
     [](const fs::path& d) {
       for (const char* name : {"cameras.bin", "images.bin", "frames.bin"})
         core::write_file(d / kSparse / name, std::string_view(""));
     },
     "truncated", true},
    {"TruncatedFlow", "tartanair", [](const fs::path& d) { truncate(d / kFlow); },
     "not a sound npz", true},
    {"FlowOfAnotherCrc", "tartanair", [](const fs::path& d) { flip_bit(d / kFlow); }, "is damaged",
     true},
    {"FlowOfAnotherShape", "tartanair", [](const fs::path& d) { swap_flow_for_mask(d / kFlow); },
     "flow_fwd must have the shape", true},
    {"FlowOfAnotherName", "tartanair",
     [](const fs::path& d) {
       fs::rename(d / kFlow, d / kTartanAir / "flow_lcam_front/000000_000002_lcam_front_flow.npz");
     },
     "000000_000001_lcam_front_flow.npz: missing", true},
    {"PoseRowTooMany", "tartanair",
     [](const fs::path& d) {
       const fs::path file = d / kTartanAir / "pose_lcam_front.txt";
       const std::string text = core::read_text_file(file);
       core::write_file(file, text + text.substr(0, text.find('\n') + 1));
     },
     "4 rows for 3 frames", true},
    {"DepthNotANumber", "tartanair",
     [](const fs::path& d) {
       write_image(d / kTartanAir / "depth_lcam_front/000001_lcam_front_depth.png", 4, 66, 255);
     },
     "nan at pixel (5, 7)", true},
    {"UnknownClass", "tartanair",
     [](const fs::path& d) {
       write_image(d / kTartanAir / "seg_rcam_front/000001_rcam_front_seg.png", 1, 1, 255);
     },
     "class 255 at pixel (5, 7)", true},
    {"SkyWithDepth", "tartanair",
     [](const fs::path& d) {
       write_image(d / kTartanAir / "seg_rcam_front/000001_rcam_front_seg.png", 1, 1, 0);
     },
     "class sky at pixel (5, 7), where depth is a surface's", true},
    {"MissingMask", "tartanair_v1",
     [](const fs::path& d) { fs::remove(d / kTartanAirV1 / "flow/000001_000002_mask.npy"); },
     "000001_000002_mask.npy: missing", true},
    {"MaskOfAnotherValue", "tartanair_v1",
     [](const fs::path& d) {
       write_last_byte(d / kTartanAirV1 / "flow/000000_000001_mask.npy", '\x07');
     },
     "7 at pixel (639, 479); sums of 1, 10 and 100", true},
    {"FlowTooMany", "tartanair_v1",
     [](const fs::path& d) {
       fs::copy_file(d / kTartanAirV1 / "flow/000000_000001_flow.npy",
                     d / kTartanAirV1 / "flow/000002_000003_flow.npy");
     },
     "5 files for 3 frames", true},
    {"DepthNegative", "tartanair_v1",
     [](const fs::path& d) {
       write_last_byte(d / kTartanAirV1 / "depth_right/000002_right_depth.npy", '\xc2');
     },
     "pixel (639, 479); more than 0", true},
    {"ClassesAsFloats", "tartanair_v1",
     [](const fs::path& d) {
       fs::copy_file(d / kTartanAirV1 / "depth_left/000000_left_depth.npy",
                     d / kTartanAirV1 / "seg_left/000000_left_seg.npy",
                     fs::copy_options::overwrite_existing);
     },
     "unsigned bytes are right", true},
};

INSTANTIATE_TEST_SUITE_P(Kinds, Damaged, testing::ValuesIn(kDamages),
                         [](const auto& one) { return one.param.name; });

TEST(DamagedTartanAir, AnotherBaselineIsFoundThoughMountsAndPosesAgree) {
  const test::ScratchFolder scratch;
  for (const double baseline_m : {0.25, 0.26}) {
    const fs::path folder = scratch / fmt::format("{}", baseline_m);
    test::write_tartanair(blank_flight(baseline_m), folder);
    const CheckResult structure = structure_of(run(folder, scratch / "report"));
    EXPECT_EQ(structure.ok, baseline_m == 0.25) << structure.worst;
    EXPECT_EQ(structure.worst.find("rcam_front stands (0.2600, ") != std::string::npos,
              baseline_m != 0.25)
        << structure.worst;
  }
}

/// The blank flight with the right camera as another face of the left side.
test::Recording flight_with_face(const std::string& name, double left_deg) {
  test::Recording recording = blank_flight(0.0);
  recording.cameras[1].name = name;
  recording.cameras[1].body_from_camera =
      recording.cameras[0].body_from_camera *
      Eigen::AngleAxisd(-left_deg * 3.14159265358979323846 / 180.0, Eigen::Vector3d::UnitY());
  return recording;
}

TEST(DamagedTartanAir, AFaceThatLooksElsewhereThanItsNameSaysIsFound) {
  const test::ScratchFolder scratch;
  const struct {
    const char* name;
    double left_deg;
    const char* finding;
  } cases[] = {{"lcam_left", 90.0, nullptr},
               {"lcam_right", -90.0, nullptr},
               {"lcam_back", 180.0, nullptr},
               {"lcam_left", 90.01, "lcam_left stands 0.0000 m from lcam_front and looks 0.0100"},
               {"lcam_right", 90.0, "lcam_right stands 0.0000 m from lcam_front and looks 180"},
               {"lcam_up", 90.0, "the format has no camera lcam_up"}};
  for (const auto& [name, left_deg, finding] : cases) {
    const fs::path folder = scratch / fmt::format("{}{}", name, left_deg);
    test::write_tartanair(flight_with_face(name, left_deg), folder);
    const CheckResult structure = structure_of(run(folder, scratch / "report"));
    EXPECT_EQ(structure.ok, finding == nullptr) << structure.worst;
    if (finding == nullptr) continue;
    EXPECT_NE(structure.worst.find(finding), std::string::npos) << structure.worst;
  }
}

TEST(DamagedNpz, IsRefusedByTheSizeOfAllArraysBeforeTheyAreRead) {
  const test::ScratchFolder scratch;
  const fs::path file = scratch / "bomb.npz";
  const std::vector<char> zeros(std::size_t{1} << 27);
  zip_t* archive = zip_open(file.c_str(), ZIP_CREATE, nullptr);
  for (const char* name : {"a.npy", "b.npy", "c.npy"}) {
    const zip_int64_t index = zip_file_add(
        archive, name, zip_source_buffer(archive, zeros.data(), zeros.size(), 0), ZIP_FL_OVERWRITE);
    zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), ZIP_CM_DEFLATE, 1);
  }
  ASSERT_EQ(zip_close(archive), 0);
  EXPECT_LT(fs::file_size(file), std::size_t{1} << 23);
  try {
    parse_npz(core::read_file(file), "bomb.npz");
    FAIL() << "384 MiB were read";
  } catch (const core::Error& error) {
    EXPECT_NE(std::string(error.what()).find("its arrays have more than"), std::string::npos)
        << error.what();
  }
}

TEST(DamagedColmap, OneWrongIndexOrBitIsFound) {
  const test::ScratchFolder scratch;
  write("colmap", scratch / "data");
  replace(scratch / "data/flight/sparse_txt/0/frames.txt", "1 1 ", "1 1 0.");
  std::map<std::string, bool> ok;
  for (const CheckResult& result : run(scratch / "data", scratch / "report"))
    ok[result.name] = result.ok;
  EXPECT_FALSE(ok.at("colmap_text_binary"));
  EXPECT_TRUE(ok.at("colmap_tracks"));
}

TEST(ValidateStage, RefusesWhatIsNoDataset) {
  const test::ScratchFolder scratch;
  EXPECT_THROW(run(scratch.path(), scratch / "report"), core::Error);
  core::write_file(scratch / "dataset.json", std::string_view("{\"format\": \"kity\"}"));
  EXPECT_THROW(run(scratch.path(), scratch / "report"), core::Error);
}

TEST(ValidateReport, JoinsFormatsUnderTheirNames) {
  const test::ScratchFolder scratch;
  for (const char* format : {"kitti", "colmap"}) {
    write(format, scratch / "data" / format);
    run(scratch / "data" / format, scratch / "report" / format);
  }
  const bool is_ok = join_reports(scratch / "report", {"kitti", "colmap"});
  const core::Json joined = core::Json::read(scratch / "report/report.json");
  EXPECT_EQ(joined.at("ok").boolean(), is_ok);
  const std::string first = joined.at("checks").at(0).at("name").string();
  EXPECT_TRUE(first.starts_with("kitti/")) << first;
  const std::string html = core::read_text_file(scratch / "report/kitti/index.html");
  EXPECT_NE(html.find("src=\"page/data.js\""), std::string::npos);
  const std::string start = core::read_text_file(scratch / "report/index.html");
  for (const char* format : {"kitti", "colmap"})
    EXPECT_NE(start.find(fmt::format("href=\"{}/index.html\"", format)), std::string::npos);
}

TEST(ValidateStage, GivesTheSameReportForAnyThreads) {
  const test::ScratchFolder scratch;
  write("colmap", scratch / "data");
  const core::Log log("validate", core::LogLevel::Off);
  for (const int threads : {1, 2}) {
    core::Context context{log};
    context.num_threads = threads;
    run_validate_stage(scratch / "data", {}, scratch / ("report" + std::to_string(threads)),
                       context);
  }
  EXPECT_EQ(test::first_difference(scratch / "report1", scratch / "report2"), "");
}

}  // namespace
}  // namespace terracast::validate
