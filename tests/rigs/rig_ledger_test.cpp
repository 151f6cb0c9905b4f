#include <gtest/gtest.h>
#include <zip.h>

#include <functional>
#include <map>
#include <set>

#include "rigs/key_record.h"
#include "rigs/rig_file.h"
#include "tests/rigs/lens_formulas.h"
#include "tests/rigs/shipped_rigs.h"
#include "tests/support/expect_error.h"

// Laws of all formats: nothing that a file says goes by unseen.
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using test::expect_error;
namespace fs = std::filesystem;

/// A right file, whose text may have one thing more at each of several places: `more` gives what stands there.
using More = std::function<std::string(int place, const std::string& text)>;
struct Sample {
  int num_places;
  std::function<fs::path(const fs::path& folder, const More& more)> write;
};

std::string more_key(const More& more, int place, const std::string& indent) {
  return more(place, indent + "more: 1\n");
}

fs::path write_kalibr_sample(const fs::path& folder, const More& more) {
  core::write_file(folder / "chain.yaml",
                   "cam0:\n  camera_model: pinhole\n  distortion_model: radtan\n"
                   "  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]\n  resolution: [752, 480]\n"
                   "  intrinsics: [458.5, 457.25, 367.25, 248.5]\n  rostopic: /cam0/image_raw\n"
                   "  cam_overlaps: []\n  timeshift_cam_imu: 0.0\n"
                   "  T_cam_imu: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n" +
                       more_key(more, 0, "  ") + more_key(more, 1, ""));
  return folder / "chain.yaml";
}

fs::path write_opencv_sample(const fs::path& folder, const More& more) {
  const auto matrix = [&](int rows, int cols, const char* data, int place) {
    return fmt::format(
               " !!opencv-matrix\n     rows: {}\n     cols: {}\n     dt: d\n     data: {}\n", rows,
               cols, data) +
           more_key(more, place, "     ");
  };
  core::write_file(folder / "rig.yaml",
                   "%YAML:1.0\n---\nrig: r\n" + more_key(more, 0, "") +
                       "cameras:\n -\n   name: a\n   image_width: 64\n   image_height: 48\n   "
                       "fisheye_model: 0\n" +
                       more_key(more, 1, "   ") +
                       "   camera_matrix:" + matrix(3, 3, "[30, 0, 32, 0, 30, 24, 0, 0, 1]", 2) +
                       "   distortion_coefficients:" + matrix(1, 4, "[0.1, 0, 0, 0]", 3) +
                       "   R:" + matrix(3, 3, "[1, 0, 0, 0, 1, 0, 0, 0, 1]", 4) +
                       "   T:" + matrix(3, 1, "[0, 0, 0]", 5));
  return folder / "rig.yaml";
}

fs::path write_ros_sample(const fs::path& folder, const More& more) {
  core::write_file(folder / "ost.yaml",
                   "image_width: 64\nimage_height: 48\ncamera_name: a\ncamera_matrix:\n  rows: 3\n"
                   "  cols: 3\n  data: [30, 0, 32, 0, 30, 24, 0, 0, 1]\n" +
                       more_key(more, 0, "  ") +
                       "distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 4, "
                       "data: [0.1, 0, 0, 0]}\nprojection_matrix: {rows: 3, cols: 4, data: [30, 0, "
                       "32, 0, 0, 30, 24, 0, 0, 0, 1, 0]}\n" +
                       more_key(more, 1, ""));
  return folder / "ost.yaml";
}

fs::path write_vins_sample(const fs::path& folder, const More& more) {
  core::write_file(
      folder / "cam0.yaml",
      "%YAML:1.0\n---\nmodel_type: MEI\ncamera_name: a\nimage_width: 64\n"
      "image_height: 48\nmirror_parameters:\n   xi: 1.5\n" +
          more_key(more, 0, "   ") +
          "distortion_parameters:\n   k1: 0.1\n   k2: 0.0\n   p1: 0.0\n   p2: 0.0\n" +
          more_key(more, 1, "   ") +
          "projection_parameters:\n   gamma1: 30\n   gamma2: 30\n   u0: 32\n   v0: 24\n" +
          more_key(more, 2, "   ") + more_key(more, 3, ""));
  core::write_file(folder / "config.yaml",
                   "%YAML:1.0\nimu: 1\nnum_of_cam: 1\ncam0_calib: cam0.yaml\ntd: 0.0\n"
                   "body_T_cam0: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n"
                   "   data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n" +
                       more_key(more, 4, ""));
  return folder / "config.yaml";
}

fs::path write_orb_slam_sample(const fs::path& folder, const More& more) {
  core::write_file(folder / "settings.yaml",
                   "%YAML:1.0\nCamera.type: PinHole\nCamera1.fx: 30\nCamera1.fy: 30\n"
                   "Camera1.cx: 32\nCamera1.cy: 24\nCamera1.k1: 0.1\nCamera1.k2: 0\n"
                   "Camera1.p1: 0\nCamera1.p2: 0\nCamera.width: 64\nCamera.height: 48\n"
                   "IMU.T_b_c1: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n"
                   "   data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n" +
                       more_key(more, 0, ""));
  return folder / "settings.yaml";
}

fs::path write_carla_sample(const fs::path& folder, const More& more) {
  core::write_file(folder / "objects.json",
                   R"({"objects": [{"type": "vehicle.a", "id": "ego", "objects": [)"
                   R"({"type": "sensor.camera.rgb", "id": "a", "image_size_x": 64)" +
                       more(0, R"(, "more": 1)") + R"(, "spawn_point": {"x": 1.0)" +
                       more(1, R"(, "more": 1)") + "}}]" + more(2, R"(, "more": 1)") + "}]" +
                       more(3, R"(, "more": {"deep": 1})") + "}");
  return folder / "objects.json";
}

fs::path write_ouster_sample(const fs::path& folder, const More& more) {
  core::write_file(
      folder / "os.json",
      R"({"beam_intrinsics": {"beam_altitude_angles": [1, -1], "beam_azimuth_angles": [4, -4])" +
          more(0, R"(, "more": 1)") + R"(}, "config_params": {"lidar_mode": "512x10"}, )" +
          R"("lidar_intrinsics": {"lidar_to_sensor_transform": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1])" +
          more(1, R"(, "more": 1)") + R"(}, "lidar_data_format": {"column_window": [0, 511])" +
          more(2, R"(, "more": 1)") + "}" + more(3, R"(, "more": {"deep": 1})") + "}");
  return folder / "os.json";
}

fs::path write_velodyne_sample(const fs::path& folder, const More& more) {
  core::write_file(folder / "db.yaml",
                   "num_lasers: 1\nlasers:\n- laser_id: 0\n  rot_correction: 0.1\n"
                   "  vert_correction: 0.2\n" +
                       more_key(more, 0, "  ") + more_key(more, 1, ""));
  return folder / "db.yaml";
}

fs::path write_colmap_sample(const fs::path& folder, const More& more) {
  core::write_file(folder / "cameras.txt",
                   "1 PINHOLE 64 48 30 30 32 24\n2 PINHOLE 64 48 30 30 32 24\n");
  core::write_file(folder / "rig_config.json",
                   R"([{"cameras": [{"image_prefix": "r/a/", "ref_sensor": true)" +
                       more(0, R"(, "more": 1)") +
                       R"(}, {"image_prefix": "r/b/", "cam_from_rig_rotation": [1, 0, 0, 0], )"
                       R"("cam_from_rig_translation": [0, 0, 0]}])" +
                       more(1, R"(, "more": {"deep": 1})") + "}]");
  return folder;
}

fs::path write_csv_sample(const fs::path& folder, const More& more) {
  core::write_file(folder / "rig.csv", "Camera,width_px,height_px,fx_px" +
                                           more(0, ",Inventory number") + more(1, ",") +
                                           "\na,64,48,30" + more(0, ",x") + more(1, ",x") + "\n");
  return folder / "rig.csv";
}

fs::path write_xlsx_sample(const fs::path& folder, const More& more) {
  const auto cell = [](const std::string& text) {
    return "<c t=\"inlineStr\"><is><t>" + text + "</t></is></c>";
  };
  const std::map<std::string, std::string> parts = {
      {"xl/workbook.xml",
       "<workbook xmlns:r=\"r\"><sheets><sheet name=\"rig\" r:id=\"rId1\"/></sheets></workbook>"},
      {"xl/_rels/workbook.xml.rels",
       "<Relationships><Relationship Id=\"rId1\" Target=\"worksheets/a.xml\"/></Relationships>"},
      {"xl/worksheets/a.xml", "<worksheet><sheetData><row>" + cell("name") + cell("width_px") +
                                  cell("height_px") + cell("fx_px") +
                                  more(0, cell("Inventory number")) + "</row><row>" + cell("a") +
                                  cell("64") + cell("48") + cell("30") + more(0, cell("x")) +
                                  more(1, cell("x")) + "</row></sheetData></worksheet>"}};
  int code = 0;
  zip_t* archive = zip_open((folder / "rig.xlsx").c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  for (const auto& [name, text] : parts)
    zip_file_add(archive, name.c_str(), zip_source_buffer(archive, text.data(), text.size(), 0), 0);
  zip_close(archive);
  return folder / "rig.xlsx";
}

const std::map<std::string_view, Sample>& samples() {
  static const std::map<std::string_view, Sample> table = {
      {"carla", {4, write_carla_sample}},       {"colmap", {2, write_colmap_sample}},
      {"csv", {2, write_csv_sample}},           {"kalibr", {2, write_kalibr_sample}},
      {"opencv", {6, write_opencv_sample}},     {"orb_slam", {1, write_orb_slam_sample}},
      {"ouster", {4, write_ouster_sample}},     {"ros", {2, write_ros_sample}},
      {"velodyne", {2, write_velodyne_sample}}, {"vins", {5, write_vins_sample}},
      {"xlsx", {2, write_xlsx_sample}},
  };
  return table;
}

std::int64_t num_unknown(const core::Ledger& ledger) {
  std::int64_t sum = 0;
  for (const auto& [name, entry] : ledger.entries()) sum += entry.num_unknown;
  return sum;
}

/// The used entry of a format's tables for a name; nullptr: none has it as used.
const core::KnownName* find_used(const RigFormatInfo& format, const std::string& name) {
  for (const core::KnownTable& table : format.known())
    if (const core::KnownName* found = core::find_known(table.names, name); found != nullptr)
      return found->is_used ? found : nullptr;
  return nullptr;
}

TEST(RigLedgers, HaveOneThingMoreAsUnknown) {
  for (const RigFormatInfo& format : rig_formats()) {
    SCOPED_TRACE(format.name);
    ASSERT_TRUE(samples().contains(format.name)) << "give the format a sample here";
    const Sample& sample = samples().at(format.name);
    const fs::path folder = test_folder("ledger");
    const auto read_with = [&](int wanted) {
      const fs::path path = sample.write(folder, [&](int place, const std::string& text) {
        return place == wanted ? text : std::string();
      });
      EXPECT_EQ(find_rig_format(path).name, format.name);
      return format.read(path, {});
    };
    const ImportedRig plain = read_with(-1);
    EXPECT_EQ(num_unknown(plain.ledger), 0) << plain.ledger.table();
    for (int place = 0; place < sample.num_places; ++place) {
      SCOPED_TRACE(place);
      const ImportedRig read = read_with(place);
      EXPECT_EQ(num_unknown(read.ledger), 1) << read.ledger.table();
      expect_told(read.ledger, {"is not known"});
      EXPECT_EQ(rig_toml(read.rig), rig_toml(plain.rig));
    }
  }
}

TEST(RigLedgers, UseNoNameThatTheirTablesDoNotHave) {
  for (const RigFormatInfo& format : rig_formats()) {
    SCOPED_TRACE(format.name);
    const ImportedRig read =
        format.read(samples()
                        .at(format.name)
                        .write(test_folder("ledger_used"),
                               [](int, const std::string&) { return std::string(); }),
                    {});
    std::int64_t num_used = 0;
    for (const auto& [name, entry] : read.ledger.entries()) {
      num_used += entry.num_used;
      if (entry.num_used > 0) {
        EXPECT_NE(find_used(format, name), nullptr) << name;
      }
    }
    EXPECT_GE(num_used, 4);  // a camera has a name, a size and a focal length at least
    if (format.write == nullptr) continue;
    // What the format itself writes, of all keys that a rig may state.
    const fs::path path =
        test_folder("ledger_written") / (format.is_table ? fmt::format("rig.{}", format.name)
                                         : format.name == "colmap" ? "rig"
                                                                   : "rig.yaml");
    format.write(shipped_rig("mcs4"), path);
    const ImportedRig own = format.read(path, {});
    EXPECT_TRUE(lines_not_used(own.ledger).empty())
        << testing::PrintToString(lines_not_used(own.ledger));
    for (const auto& [name, entry] : own.ledger.entries())
      EXPECT_NE(find_used(format, name), nullptr) << name;
  }
}

TEST(RigLedgers, TablesNameEachThingOnceAndSayWhatItIs) {
  for (const core::KnownTable& table : known_names_of_rigs()) {
    std::set<std::string_view> names;
    for (const core::KnownName& name : table.names) {
      EXPECT_TRUE(names.insert(name.name).second) << table.reader << ": " << name.name;
      EXPECT_FALSE(name.words.empty()) << table.reader << ": " << name.name;
    }
    EXPECT_FALSE(names.empty()) << table.reader;
  }
}

/// Whatever is cut off: a file is read or refused, and nothing else happens.
TEST(RigFiles, ThatAreCutOffAreReadOrRefused) {
  for (const RigFormatInfo& format : rig_formats()) {
    SCOPED_TRACE(format.name);
    const fs::path folder = test_folder("ledger_cut");
    const fs::path path = samples().at(format.name).write(folder, [](int, const std::string&) {
      return std::string();
    });
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string whole = core::read_text_file(entry.path(), 1 << 20);
      int num_refused = 0;
      for (std::size_t size = 0; size < whole.size(); size += 3) {
        core::write_file(entry.path(), whole.substr(0, size));
        try {
          import_rig(format, path, {});
        } catch (const core::Error& error) {
          // Io: what is left of the name of a camera's file names none.
          EXPECT_TRUE(error.kind() == ErrorKind::Input || error.kind() == ErrorKind::Io)
              << error.what() << " after " << size;
          ++num_refused;
        }
      }
      EXPECT_GT(num_refused, 0) << entry.path();
      core::write_file(entry.path(), whole);
    }
  }
}

TEST(RigLedgers, SheetsAfterTheFirstAreNamed) {
  const fs::path folder = test_folder("ledger_sheets");
  write_xlsx_sample(folder, [](int, const std::string&) { return std::string(); });
  zip_t* archive = zip_open((folder / "rig.xlsx").c_str(), 0, nullptr);
  const std::string workbook =
      "<workbook xmlns:r=\"r\"><sheets><sheet name=\"rig\" r:id=\"rId1\"/><sheet name=\"second "
      "rig\" r:id=\"rId2\"/></sheets></workbook>";
  zip_file_add(archive, "xl/workbook.xml",
               zip_source_buffer(archive, workbook.data(), workbook.size(), 0), ZIP_FL_OVERWRITE);
  ASSERT_EQ(zip_close(archive), 0);
  const ImportedRig read =
      core::find_registered(rig_formats(), "format", "xlsx").read(folder / "rig.xlsx", {});
  expect_told(read.ledger, {"not used: sheet: second rig", "first sheet"});
}

/// A key that holds a dot is not the key of a map in a map.
TEST(KeyRecords, TellNestedKeysFromDottedOnes) {
  constexpr std::array kKnown = {core::KnownName{"a", "a map"}, core::KnownName{"a.b", "in it"}};
  KeyRecord record;
  record.open({}, {"a", "a.b"}, "x.yaml");
  record.take({"a"});
  record.open({"a"}, {"b"}, "x.yaml: a");
  record.take({"a", "b"});
  const core::Ledger ledger = record.ledger(kKnown);
  EXPECT_EQ(ledger.entries().at("a.b").num_used, 1);
  EXPECT_EQ(ledger.entries().at("a.b").num_ignored, 1);  // nobody took the dotted one
  EXPECT_EQ(KeyRecord::name_of({"cameras", "[12]", "T"}), "cameras[].T");
  EXPECT_EQ(KeyRecord::numbered_name_of({"cam12_calib"}), "camN_calib");
  EXPECT_EQ(KeyRecord::numbered_name_of({"cam0", "k1"}), "camN.k1");
  expect_error(ErrorKind::Input, {"x.yaml: c", "the key k stands twice"}, [&] {
    record.open({"c"}, {"k", "l", "k"}, "x.yaml: c");
  });
}

}  // namespace
}  // namespace terracast::rigs
