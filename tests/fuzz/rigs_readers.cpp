// Rigs of other programs.

#include <zip.h>

#include <array>
#include <string>

#include "core/error.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "tests/fuzz/scratch.h"

namespace terracast::fuzz {
namespace {

namespace fs = std::filesystem;

/// Has all formats look at a path, one read it, and what was read written as a rig file.
void read_rig(std::string_view name, const fs::path& path) {
  try {
    rigs::find_rig_format(path);
  } catch (const core::Error& error) {
    if (error.kind() == core::ErrorKind::Internal) throw;
  }
  for (const rigs::RigFormatInfo& format : rigs::rig_formats()) {
    if (format.name != name) continue;
    const rigs::ImportedRig read =
        rigs::import_rig(format, path, {.name = "", .axes = "flu", .imu_rate_hz = 200.0});
    rigs::lines_not_used(read.ledger);
    rigs::rig_toml(read.rig);
  }
}

/// A zip of parts, as they are named.
void write_zip(const fs::path& file, const std::vector<Part>& parts) {
  int code = 0;
  zip_t* archive = zip_open(file.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  if (archive == nullptr) core::fail(core::ErrorKind::Internal, "zip_open: {}", code);
  for (const Part& part : parts) {
    if (part.name.empty()) continue;
    zip_source_t* source = zip_source_buffer(archive, part.bytes.data(), part.bytes.size(), 0);
    // Names that stand twice, or are none, are left out.
    if (zip_file_add(archive, std::string(part.name).c_str(), source, 0) < 0)
      zip_source_free(source);
  }
  if (zip_close(archive) != 0) zip_discard(archive);
}

}  // namespace

void fuzz_rig_csv(Bytes input) { read_rig("csv", put("rig.csv", input)); }
void fuzz_rig_carla(Bytes input) { read_rig("carla", put("objects.json", input)); }
void fuzz_rig_opencv(Bytes input) { read_rig("opencv", put("rig.yaml", input)); }
void fuzz_rig_orb_slam(Bytes input) { read_rig("orb_slam", put("settings.yaml", input)); }
void fuzz_rig_ouster(Bytes input) { read_rig("ouster", put("os.json", input)); }
void fuzz_rig_velodyne(Bytes input) { read_rig("velodyne", put("db.yaml", input)); }
void fuzz_rig_ros(Bytes input) { read_rig("ros", put("ost.yaml", input)); }

/// A chain with the IMUs beside it.
void fuzz_rig_kalibr(Bytes input) {
  static constexpr std::array<std::string_view, 3> kNames = {"chain.yaml", "imu.yaml",
                                                             "kalibr_imu_chain.yaml"};
  read_rig("kalibr", put_parts(input, kNames) / "chain.yaml");
}

/// A folder of rig_config.json and cameras.txt.
void fuzz_rig_colmap(Bytes input) {
  static constexpr std::array<std::string_view, 3> kNames = {"rig_config.json", "cameras.txt",
                                                             "images.txt"};
  read_rig("colmap", put_parts(input, kNames));
}

/// An estimator's file with a camera's.
void fuzz_rig_vins(Bytes input) {
  static constexpr std::array<std::string_view, 3> kNames = {"config.yaml", "cam0.yaml",
                                                             "cam1.yaml"};
  read_rig("vins", put_parts(input, kNames) / "config.yaml");
}

void fuzz_rig_xlsx(Bytes input) { read_rig("xlsx", put("rig.xlsx", input)); }

/// Parts of the input as the members of a workbook.
void fuzz_rig_xlsx_sheets(Bytes input) {
  const fs::path file = fresh_folder() / "rig.xlsx";
  write_zip(file, parts_of(input));
  read_rig("xlsx", file);
}

}  // namespace terracast::fuzz
